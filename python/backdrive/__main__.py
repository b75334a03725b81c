"""The command line: `python -m backdrive`, which `pip install` also calls `backdrive`."""

from __future__ import annotations

import os
import signal
import sys

from ._backdrive import command_line


def main() -> None:
    """Runs the command line with the arguments of this process, and ends it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C is the program's, not the interpreter's
    code = command_line(sys.argv[1:], [sys.executable, "-m", "backdrive"])
    sys.stdout.flush()
    os._exit(code)  # nothing of the interpreter is left to end


if __name__ == "__main__":
    main()
