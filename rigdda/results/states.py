"""The state of a barrier over time, as outcomes judge it and replays show it."""

from __future__ import annotations

from rigdda.dynamics.run import Run

STANDS = "stands"


def states(run: Run, index: int) -> list[tuple[float, str]]:
    """Return the states of a barrier, each with the time from which it is in it [s].

    The first is "stands"; a fence "failed", an embankment was "pushed", a gravity wall "slid" or
    is "overturned", by the frames of the run.
    """
    barrier, poses = run.scene.barriers[index], run.barrier_poses[:, index]
    start = (float(run.times[0]), STANDS)
    return [start, *barrier.changes(run.times, poses, run.failure(index))]
