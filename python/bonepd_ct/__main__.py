"""The command ``bonepd-ct``: the same program, in the words of its own command line."""

import signal
import sys

from . import _native


def main() -> int:
    """The command line with the words of ``sys.argv``; returns the exit code."""
    # Ctrl-C ends the program, as it ends any command: the interpreter would only take note of it.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.main(["bonepd-ct", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
