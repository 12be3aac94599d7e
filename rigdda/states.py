"""The state of a barrier over time, as replays show it."""

from __future__ import annotations

import math

import numpy as np

from rigdda.barriers import Embankment, GravityWall
from rigdda.outcome import SLID
from rigdda.run import Run

STANDS = "stands"


def states(run: Run, index: int) -> list[tuple[float, str]]:
    """Return the states of a barrier, each with the time from which it is in it [s].

    The first is "stands"; a fence "failed", an embankment was "pushed", a gravity wall "slid" or
    is "overturned", by the frames of the run.
    """
    out, barrier = [(float(run.times[0]), STANDS)], run.scene.barriers[index]
    if isinstance(barrier, GravityWall):
        x, y, theta = (run.barrier_poses[:, index] - run.barrier_poses[0, index]).T
        diagonal = math.atan2(barrier.thickness, barrier.height)
        for state, there in (
            ("slid", np.hypot(x, y) > SLID),
            ("overturned", abs(theta) > diagonal),
        ):
            if there.any():
                out.append((float(run.times[int(there.argmax())]), state))
        return out if len(out) < 3 or out[1][0] < out[2][0] else [out[0], out[2]]
    failure = run.failure(index)
    if math.isfinite(failure):
        out.append((failure, "pushed" if isinstance(barrier, Embankment) else "failed"))
    return out
