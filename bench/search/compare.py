"""Bee colony and particle swarm beside those of mealpy, on the same problems with the same evaluations.

    python compare.py SEARCH_FUNCTIONS [SEEDS]

SEARCH_FUNCTIONS: the example program `search_functions` of dynid-estimate. Prints a table of medians of the best values
over the seeds and of evaluations per second of the fastest run (others share the machine), one thread each. mealpy ends
after the iteration in which the budget is used up, so it never makes fewer evaluations than ours.
"""

import json
import subprocess
import sys
import time

import numpy as np
from mealpy import ABC, PSO, FloatVar


def sphere(x):
    return np.sum(x * x)


def rosenbrock(x):
    return np.sum(100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1.0 - x[:-1]) ** 2)


def rastrigin(x):
    return np.sum(x * x - 10.0 * np.cos(2 * np.pi * x) + 10.0)


def ackley(x):
    waves = np.mean(np.cos(2 * np.pi * x))
    return 20.0 - 20.0 * np.exp(-0.2 * np.sqrt(np.mean(x * x))) + np.e - np.exp(waves)


def griewank(x):
    return 1.0 + np.sum(x * x) / 4000.0 - np.prod(np.cos(x / np.sqrt(np.arange(1, x.size + 1))))


def er16(problem):
    columns = np.array(problem["columns"]).transpose(0, 2, 1).copy()
    effort, velocity = np.array(problem["effort"]), np.array(problem["velocity"])
    amplitudes = np.array(problem["amplitudes"])
    samples, linear = effort.shape[1], columns.shape[2]

    def value(x):
        curved = x[amplitudes, None] * np.arctan(x[linear:, None] * velocity)
        return np.sum(np.abs(effort - columns @ x[:linear] - curved)) / samples

    found = value(np.array(problem["truth"]))
    assert abs(found - problem["value_of_truth"]) < 1e-9, found
    return value


def mealpy_runs(kind, value, lower, upper, budget, seeds):
    """Best values, and evaluations per second of the fastest run."""
    make = {"abc": ABC.OriginalABC, "pso": PSO.OriginalPSO}[kind]
    values, fastest = [], 0.0
    for seed in range(1, seeds + 1):
        model = make(epoch=100000, pop_size=50)
        problem = {"bounds": FloatVar(lb=lower, ub=upper), "minmax": "min", "obj_func": value, "log_to": None}
        begin = time.perf_counter()
        best = model.solve(problem, termination={"max_fe": budget}, seed=seed)
        fastest = max(fastest, model.nfe_counter / (time.perf_counter() - begin))
        assert model.nfe_counter >= budget
        values.append(best.target.fitness)
    return values, fastest


def main():
    program = sys.argv[1]
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 15
    problem = json.loads(subprocess.run([program, "problem"], capture_output=True, check=True).stdout)
    names = ["abc-general", "pso-general"]
    lines = subprocess.run([program, "run", str(seeds), *names], capture_output=True, check=True, text=True)
    ours = [json.loads(line) for line in lines.stdout.splitlines()]
    widths = {"sphere": 100.0, "rosenbrock": 30.0, "rastrigin": 5.12, "ackley": 32.0, "griewank": 600.0}
    print("| algorithm | problem | d | evaluations | ours, median | mealpy, median | ours, 1/s | ratio of speeds |")
    print("|---|---|---|---|---|---|---|---|")
    for line in ours:
        d, name = line["dimensions"], line["function"]
        if name == "er16":
            value, lower, upper = er16(problem), problem["lower"], problem["upper"]
        else:
            value, lower, upper = globals()[name], [-widths[name]] * d, [widths[name]] * d
        kind = line["algorithm"].split("-")[0]
        theirs, speed = mealpy_runs(kind, value, lower, upper, line["budget"], seeds)
        mine = float(np.median(line["values"]))
        rate = line["evaluations_per_second"]
        print(
            f"| {kind} | {name} | {d} | {line['budget']} | {mine:.3g} | {np.median(theirs):.3g} "
            f"| {rate:.2g} | {rate / speed:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
