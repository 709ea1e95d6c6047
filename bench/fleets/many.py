#!/usr/bin/env python3
"""Many logs, some of them broken, reduced by processes that are killed again and again: nothing is lost, nothing counts twice, and every broken log is named.

    many.py ROBOT FOLDER [--robots 500] [--logs 20] [--broken 100] [--kills 100] [--seed 1] [--dynid PROGRAM]

Makes a fleet of ROBOTS x LOGS logs of 3 s, breaks some (cut off, a number that is none, a column that is gone, empty, no table at all, a file that is missing), and
fills a folder of factors by `xargs -P 2` with one process per hundred logs, one of which is killed (`kill -9`) at a random time until that has happened often
enough. Another folder is filled once, undisturbed, from the sound logs alone. Checked: the files of factors of both folders are the same, byte for byte; the
failures are the broken logs; `dynid fleet` says the same of both. Needs 100 kB of disk per log.
"""

import argparse
import filecmp
import gzip
import json
import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

SETTINGS = "duration_s = 3\nrate_hz = 100\n[fleet]\nrobots = {robots}\nlogs = {logs}\nwear = 5\nfaults = 5\n"
FAULTS = ["cut", "number", "column", "empty", "garbage", "missing"]


def spoil(path, fault):
    """Breaks a log in one of several ways."""
    if fault == "missing":
        path.unlink()
        return
    lines = gzip.decompress(path.read_bytes()).decode().splitlines(keepends=True)
    if fault == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        return
    if fault == "number":
        cells = lines[100].split(",")
        lines[100] = ",".join([*cells[:3], "broken", *cells[4:]])
    if fault == "column":
        lines = [",".join(line.split(",")[:-1]) + "\n" for line in lines]
    text = {"empty": "", "garbage": "\x00\x01no table\n" * 50}.get(fault, "".join(lines))
    path.write_bytes(gzip.compress(text.encode(), 1))


def children(pid):
    """Processes under a process, by what the kernel says of each."""
    out = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, rest = entry.read_text().rsplit(")", 1)
        except OSError:
            continue
        if int(rest.split()[1]) == pid:
            out.append((int(entry.parent.name), name.split("(", 1)[1]))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--robots", type=int, default=500)
    parser.add_argument("--logs", type=int, default=20)
    parser.add_argument("--broken", type=int, default=100)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--dynid", default="dynid")
    args = parser.parse_args()
    folder = args.folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    rng = random.Random(args.seed)

    def run(*words):
        done = subprocess.run([args.dynid, *map(str, words)], cwd=folder, capture_output=True, text=True)
        # A fit that is not to be trusted is a result.
        if done.returncode > 1:
            raise SystemExit(f"dynid {' '.join(map(str, words))}: {done.stderr}")
        return done.stdout

    (folder / "fleet.toml").write_text(SETTINGS.format(robots=args.robots, logs=args.logs))
    robot = args.robot.resolve()
    run("simulate", robot, "--config", "fleet.toml", "--seed", args.seed, "--out", "made")
    taught = [word for r in range(1, 5) for word in ("--log", f"made/logs/r{r:03}-001.csv.gz")]
    run("reduce", robot, *taught, "--out", "type.factors")
    head, *rows = (folder / "made/manifest.csv").read_text().splitlines()
    broken = sorted(rng.sample(range(len(rows)), args.broken))
    for n, k in enumerate(broken):
        spoil(folder / "made" / rows[k].split(",")[0], FAULTS[n % len(FAULTS)])
    sound = [row for k, row in enumerate(rows) if k not in set(broken)]
    (folder / "made/sound.csv").write_text("\n".join([head, *sound]) + "\n")

    shards = max(1, len(rows) // 100)
    words = f"seq {shards} | RAYON_NUM_THREADS=1 xargs -P 2 -I K {args.dynid} reduce type.factors --manifest made/manifest.csv --shard K/{shards} --out factors --quiet"
    started, kills, rounds = time.monotonic(), 0, 0
    while True:
        work = subprocess.Popen(["bash", "-c", words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        rounds += 1
        while kills < args.kills and work.poll() is None:
            time.sleep(rng.uniform(0.05, 2.0))
            of_shell = [pid for pid, name in children(work.pid) if name == "xargs"]
            workers = [pid for shell in of_shell for pid, name in children(shell) if name == "dynid"]
            if workers:
                try:
                    os.kill(rng.choice(workers), signal.SIGKILL)
                    kills += 1
                except ProcessLookupError:
                    continue
        work.wait()
        if kills >= args.kills:
            break
        # Killed more often than there was work: what was made last is taken away, and made again.
        made = sorted(file for file in (folder / "factors").rglob("*.factors") if file.name != "recipe.factors")
        for file in rng.sample(made, len(made) // 10):
            file.unlink()
    told = json.loads(run("reduce", "type.factors", "--manifest", "made/manifest.csv", "--out", "factors", "--json"))
    print(f"{len(rows)} logs, {kills} processes killed in {rounds} rounds, {time.monotonic() - started:.0f} s")
    started = time.monotonic()
    run("reduce", "type.factors", "--manifest", "made/sound.csv", "--out", "undisturbed")
    print(f"undisturbed, two threads: {time.monotonic() - started:.0f} s")

    def of(name, ending):
        return {file.relative_to(folder / name): file for file in (folder / name).rglob(f"*{ending}")}

    disturbed, undisturbed = of("factors", ".factors"), of("undisturbed", ".factors")
    same = disturbed.keys() == undisturbed.keys() and all(filecmp.cmp(disturbed[k], undisturbed[k], shallow=False) for k in disturbed)
    failed = told["failures"]
    named = sorted(Path(failure["log"]).name for failure in failed)
    expected = sorted(Path(rows[k].split(",")[0]).name for k in broken)
    stray = [file for file in (folder / "factors").rglob("*") if file.is_file() and not file.name.endswith((".factors", ".failed.json"))]
    print(f"files of factors {len(disturbed)} and {len(undisturbed)}: {'the same bytes' if same else 'NOT THE SAME'}; {len(stray)} stray files")
    print(f"broken {len(expected)}, named {len(named)}: {'the same logs' if named == expected else 'NOT THE SAME'}")
    codes = {code: sum(f["code"] == code for f in failed) for code in sorted({f["code"] for f in failed})}
    print("codes: " + ", ".join(f"{code} {count}" for code, count in codes.items()))
    results = []
    for name in ["factors", "undisturbed"]:
        started = time.monotonic()
        run("fleet", name, "--out", f"{name}-fleet")
        result = json.loads((folder / f"{name}-fleet/fleet.json").read_text())
        results.append({key: result[key] for key in ["parameters", "covariates", "noise", "robots", "events"]})
        print(f"fleet of {name}: {time.monotonic() - started:.0f} s")
    print("fleets: " + ("the same" if results[0] == results[1] else "NOT THE SAME"))


if __name__ == "__main__":
    main()
