"""Replays of releases for the rerun viewer: recorded by a process, then shown by another one."""

from __future__ import annotations

import hashlib
from pathlib import Path

from rigdda.app.page.jobs import FAILED, FINISHED, RUNNING, Job

FILE = "episode.rrd"
"""Name of a recorded replay in its folder."""


def replay_arguments(site: Path, layout: Path | None, event: str, seed: int) -> list[str]:
    """Return the arguments of the command that records a release for the viewer."""
    parts = ["replay", str(site), "--event", event, "--seed", str(seed)]
    return parts if layout is None else [*parts, "--layout", str(layout)]


class Viewing:
    """The replay that is recorded and then opened in the rerun viewer.

    Parameters
    ----------
    folder : Path
        Folder of the project, in which each replay gets a folder of its own.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._record, self._viewer = Job(folder, "replay"), Job(folder, "viewer")
        self._file: Path | None = None
        self._wanted = False  # the viewer is to be started when the replay is recorded

    def open(self, arguments: list[str], texts: str) -> None:
        """Record a release and open it; an earlier viewer is closed.

        Parameters
        ----------
        arguments : list of str
            See `replay_arguments`.
        texts : str
            Texts of the site and the layout. The same release of the same texts is recorded once.

        Raises
        ------
        BadInput
            If another release is being recorded.
        """
        key = hashlib.sha256("\0".join([texts, *arguments]).encode()).hexdigest()[:8]
        out = self._folder / f"replay-{key}"
        self._viewer.cancel()
        if not (out / FILE).is_file():
            self._record.start([*arguments, "--out", str(out)])
        self._file, self._wanted = out / FILE, True

    def look(self) -> str:
        """Start the viewer when the replay is recorded, and return in words what is going on."""
        if self._file is None:
            return ""
        state = self._record.state
        if state == RUNNING:
            return "The release is being recorded."
        if not self._file.is_file():
            return f"The release was not recorded: {self._record.words or state}"
        if self._wanted:
            self._wanted = False
            self._viewer.start(["replay", str(self._file)])
        state = self._viewer.state
        words = {
            RUNNING: f"The viewer shows {self._file}.",
            FINISHED: f"The viewer was closed. Open it again: rigdda replay {self._file}",
            FAILED: f"The viewer did not start: {self._viewer.words}. To open the replay on a "
            f"machine with a screen: rerun {self._file}",
        }
        return words.get(state, "")

    def close(self) -> None:
        """End the recording and the viewer because the server ends."""
        self._record.close()
        self._viewer.close()
