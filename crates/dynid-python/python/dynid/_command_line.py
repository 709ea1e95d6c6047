"""The program `dynid`."""

import signal
import sys

from . import _native


def main() -> int:
    """Runs the program with the arguments of this process."""
    # The program has no use for Python's handler, which waits for the interpreter.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.command_line(["dynid", *sys.argv[1:]])
