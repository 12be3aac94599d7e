"""The process of a long command, which ends when the page's server ends.

`python -m rigdda.app.page.worker ARGUMENTS` runs a command of the command line. Its standard input
is a pipe from the server: when the pipe is closed, because the user cancels or the server is gone,
the command is interrupted and the process ends.
"""

from __future__ import annotations

import _thread
import os
import sys
import threading
import time

GRACE = 2.0
"""Time that a command has to end after its interruption [s]."""


def _watch() -> None:
    """Wait for the end of standard input, then interrupt the command."""
    while os.read(0, 1024):
        pass
    _thread.interrupt_main()
    time.sleep(GRACE)
    os._exit(130)


def main() -> int:
    """Run the command and return its exit code."""
    threading.Thread(target=_watch, name="server", daemon=True).start()
    from rigdda.app.cli import main as command

    return command(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
