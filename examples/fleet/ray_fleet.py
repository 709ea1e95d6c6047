"""Reduces the logs of a manifest on Ray workers, and fits the fleet.

python ray_fleet.py type.factors logs/manifest.csv factors --out report
python ray_fleet.py type.factors logs/manifest.csv factors --out report --address ray://HOST:10001
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dynid
import ray

Rows = list[dynid.ManifestRow]


def reduce_many(rows: Rows, recipe: bytes) -> list[bytes]:
    """A task: what was made of every log of a batch."""
    return [dynid.reduce_log(r["path"], recipe, robot=r["robot"], start=r["start"], covariates=r["covariates"], name=r["log"]) for r in rows]


def ray_fleet(
    rows: Rows,
    store: dynid.FactorStore,
    *,
    batch: int = 100,
    in_flight: int = 64,
    work: Callable[[Rows, bytes], list[bytes]] = reduce_many,
) -> list[dict[str, Any]]:
    """Fills a store; gives the failures.

    A batch whose worker is lost is halved until one log is left. That one is tried once more with nothing beside it, so that no log answers
    for another, and is named if its worker is lost again.
    """
    failures: list[dict[str, Any]] = []
    task = ray.remote(max_retries=0)(work)
    recipe = ray.put(store.recipe)

    def kept(job: Any) -> bool:
        """Whether the worker gave a result; what the work itself raises is raised."""
        try:
            made = ray.get(job)
        except ray.exceptions.RayTaskError:
            raise
        except ray.exceptions.RayError:
            return False
        failures.extend(failure for one in made if (failure := store.put(one)))
        return True

    def split(part: Rows) -> None:
        half = len(part) // 2
        if half:
            parts.extendleft([part[:half], part[half:]])
        else:
            suspects.append(part)

    parts = deque(rows[k : k + batch] for k in range(0, len(rows), batch))
    suspects: list[Rows] = []
    jobs: dict[Any, Rows] = {}
    while parts or jobs:
        while parts and len(jobs) < in_flight:
            part = parts.popleft()
            jobs[task.remote(part, recipe)] = part
        (job,), _ = ray.wait(list(jobs))
        part = jobs.pop(job)
        if not kept(job):
            split(part)
    for part in suspects:
        if not kept(task.remote(part, recipe)):
            failures.append(store.fail(part[0]["log"], part[0]["robot"], "its worker was lost"))
    return failures


def main() -> None:
    parser = argparse.ArgumentParser(description="Fits a fleet on Ray workers.")
    parser.add_argument("recipe", help="factor file whose recipe is followed")
    parser.add_argument("manifest", help="table of logs: log,robot,start, numbers")
    parser.add_argument("folder", help="folder of factors")
    parser.add_argument("--out", default="fleet-report", help="folder of fleet.json and report.html")
    parser.add_argument("--batch", type=int, default=100, help="logs of a task")
    parser.add_argument("--workers", type=int, help="processes on this machine")
    parser.add_argument("--address", help="address of a cluster that runs, in place of processes on this machine")
    args = parser.parse_args()
    store = dynid.FactorStore(args.folder, args.recipe)
    rows = dynid.read_manifest(Path(args.manifest).resolve())
    ray.init(address=args.address, num_cpus=args.workers)
    failures = ray_fleet(rows, store, batch=args.batch)
    ray.shutdown()
    for failure in failures:
        print(f"failed: {failure['log']} ({failure['robot']}): {failure['message']}")
    found = dynid.fleet(store)
    Path(args.out).mkdir(parents=True, exist_ok=True)
    found.save(Path(args.out) / "fleet.json")
    found.report(Path(args.out) / "report.html")
    print(f"{len(store)} factors of {len(rows)} logs\n{found.status}: {found.headline}")


if __name__ == "__main__":
    main()
