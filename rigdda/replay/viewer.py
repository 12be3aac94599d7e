"""Launcher of the Rerun viewer for replay files."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from rigdda.errors import BadInput, Error
from rigdda.files import is_file


def open_viewer(path: str | os.PathLike[str]) -> None:
    """Show a replay in the Rerun viewer; return when it is closed or on Ctrl-C.

    Raises
    ------
    BadInput
        If the file is missing or is not a Rerun recording.
    Error
        If the viewer fails, for example without a display.
    """
    file = rrd_path(path)
    if not is_file(file):
        raise BadInput("replay file", str(path), "name an existing .rrd file")
    with file.open("rb") as head:
        if head.read(3) != b"RRF":
            raise BadInput("replay file", str(path), "name a .rrd file that Run.to_rerun wrote")
    if sys.platform.startswith("linux") and not {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys():
        raise Error(f"there is no screen: open {file} on a machine that has one, with rerun FILE")
    command = [sys.executable, "-m", "rerun", str(file.absolute()), "--new", "--bind", "127.0.0.1"]
    viewer = subprocess.Popen(command, start_new_session=True)
    try:
        code = viewer.wait()
    except KeyboardInterrupt:  # `python -m rerun` only starts the viewer: end its process group
        if hasattr(os, "killpg"):
            os.killpg(viewer.pid, signal.SIGTERM)
        else:  # Windows
            viewer.terminate()
        viewer.wait()
        return
    if code:
        raise Error(f"the rerun viewer ended with code {code}: see its message above")


def rrd_path(path: str | os.PathLike[str]) -> Path:
    """Return `path` after checking that the viewer will recognise its name.

    Raises
    ------
    BadInput
        If the file name does not end in .rrd.
    """
    if Path(path).suffix != ".rrd":
        raise BadInput("replay file", str(path), "let its name end in .rrd")
    return Path(path)
