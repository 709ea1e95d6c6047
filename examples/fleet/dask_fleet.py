"""Reduces the logs of a manifest on Dask workers, and fits the fleet.

python dask_fleet.py type.factors logs/manifest.csv factors --out report
python dask_fleet.py type.factors logs/manifest.csv factors --out report --scheduler tcp://HOST:8786
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import dask.config
import dynid
from distributed import Client, KilledWorker, LocalCluster, as_completed

Rows = list[dynid.ManifestRow]


def reduce_many(rows: Rows, recipe: bytes) -> list[bytes]:
    """A task: what was made of every log of a batch."""
    return [dynid.reduce_log(r["path"], recipe, robot=r["robot"], start=r["start"], covariates=r["covariates"], name=r["log"]) for r in rows]


def dask_fleet(
    client: Client,
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
    # With every task: what is scattered is lost with the workers that hold it, and a recipe is small beside the factors of a batch.
    recipe = store.recipe

    def keep(made: list[bytes]) -> None:
        failures.extend(failure for one in made if (failure := store.put(one)))

    def split(part: Rows) -> None:
        half = len(part) // 2
        if half:
            parts.extendleft([part[:half], part[half:]])
        else:
            suspects.append(part)

    parts = deque(rows[k : k + batch] for k in range(0, len(rows), batch))
    suspects: list[Rows] = []
    jobs: dict[Any, Rows] = {}
    queue = as_completed()
    while parts or jobs:
        while parts and len(jobs) < in_flight:
            part = parts.popleft()
            job = client.submit(work, part, recipe, pure=False)
            jobs[job.key] = part
            queue.add(job)
        job = next(queue)
        part = jobs.pop(job.key)
        try:
            keep(job.result())
        except KilledWorker:
            split(part)
    for part in suspects:
        try:
            keep(client.submit(work, part, recipe, pure=False).result())
        except KilledWorker as lost:
            failures.append(store.fail(part[0]["log"], part[0]["robot"], f"its worker was lost: {type(lost).__name__}"))
    return failures


def main() -> None:
    parser = argparse.ArgumentParser(description="Fits a fleet on Dask workers.")
    parser.add_argument("recipe", help="factor file whose recipe is followed")
    parser.add_argument("manifest", help="table of logs: log,robot,start, numbers")
    parser.add_argument("folder", help="folder of factors")
    parser.add_argument("--out", default="fleet-report", help="folder of fleet.json and report.html")
    parser.add_argument("--batch", type=int, default=100, help="logs of a task")
    parser.add_argument("--workers", type=int, help="processes on this machine")
    parser.add_argument("--scheduler", help="address of a scheduler that runs, in place of processes on this machine")
    args = parser.parse_args()
    store = dynid.FactorStore(args.folder, args.recipe)
    rows = dynid.read_manifest(Path(args.manifest).resolve())
    # Batches are halved here: a worker that was lost is told at once.
    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    with Client(args.scheduler or LocalCluster(n_workers=args.workers, threads_per_worker=1)) as client:
        failures = dask_fleet(client, rows, store, batch=args.batch)
    for failure in failures:
        print(f"failed: {failure['log']} ({failure['robot']}): {failure['message']}")
    found = dynid.fleet(store)
    Path(args.out).mkdir(parents=True, exist_ok=True)
    found.save(Path(args.out) / "fleet.json")
    found.report(Path(args.out) / "report.html")
    print(f"{len(store)} factors of {len(rows)} logs\n{found.status}: {found.headline}")


if __name__ == "__main__":
    main()
