#!/usr/bin/env python3
"""Writes a log of any length: repeat.py LOG.csv ROWS RATE_HZ > LONG.csv repeats the rows of a periodic log, with a clock of their own.

The last row of the log, which is the first one again, is left out. Seven digits are kept, as loggers do.
"""

import itertools
import sys

path, rows, rate = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
with open(path) as log:
    sys.stdout.write(next(log))
    tails = ["".join(f",{float(x):.7g}" for x in line.split(",")[1:]) + "\n" for line in log][:-1]
for first in range(0, rows, 10000):
    ticks = range(first, min(first + 10000, rows))
    tail = itertools.islice(itertools.cycle(tails), first % len(tails), None)
    sys.stdout.write("".join(f"{k / rate:.4f}{end}" for k, end in zip(ticks, tail)))
