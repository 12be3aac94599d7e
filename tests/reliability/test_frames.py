"""A run's frames are the states that stepping gives, whatever the interval and the number."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from physics.helpers import FLAT, box, rock

from rigdda import Diverged, GravityWall, Scene, Settings, Simulation, Terrain
from rigdda.dynamics.constants import SPEED_LIMIT
from rigdda.dynamics.frames import PIECE, pieces

DT = 0.01
SCENE = Scene(
    Terrain(FLAT), (box(0.0, 3.0), box(1.5, 2.0)), rock(), (GravityWall(4.0, 1.0, thickness=0.5),)
)


def simulation() -> Simulation:
    return Simulation(SCENE, Settings(dt=DT))


@settings(max_examples=15, deadline=None)
@given(steps=st.integers(1, 400), stride=st.integers(1, 50), before=st.integers(0, 30))
def test_frames_are_the_states_between(steps: int, stride: int, before: int) -> None:
    """The last interval may be shorter; a simulation may have run before."""
    sim, stepped = simulation(), simulation()
    for each in (sim, stepped):
        each.step(before)
    run = sim.run(steps * DT, stride * DT)
    marks = [*range(0, steps, stride), steps]
    assert run.times.tolist() == pytest.approx([(before + mark) * DT for mark in marks])
    for k, apart in enumerate(np.diff(marks, prepend=0).tolist()):
        stepped.step(apart)
        assert (run.poses[k] == stepped.poses).all()
        assert (run.velocities[k] == stepped.velocities).all()
        assert (run.barrier_poses[k] == stepped.barrier_poses).all()
    assert sim.time == stepped.time


@given(steps=st.integers(1, 10**6), stride=st.integers(1, 10**6))
def test_pieces_add_up(steps: int, stride: int) -> None:
    parts = pieces(steps, stride)
    assert sum(count * apart for count, apart in parts) == steps
    assert all(0 < count <= PIECE and 0 < apart <= stride for count, apart in parts)
    assert sum(count for count, _ in parts) == -(-steps // stride)


@pytest.mark.parametrize("every", [0.01, 0.03, 1.0])
def test_the_frames_before_a_divergence_are_kept(every: float) -> None:
    """More than a piece of them, and those of the piece in which it diverged."""
    fast = box(velocity=(0.0, 50.0 - SPEED_LIMIT, 0.0))
    scene = Scene(None, (fast,), rock())
    sim, stepped = Simulation(scene, Settings(dt=DT)), Simulation(scene, Settings(dt=DT))
    with pytest.raises(Diverged) as caught:
        sim.run(100.0, every)
    run, stride = caught.value.run, round(every / DT)
    with pytest.raises(Diverged):
        stepped.step(10**4)
    sound = round(stepped.time / DT) - 1
    assert run.times.tolist() == pytest.approx(np.arange(0, sound + 1, stride) * DT)
    assert np.isfinite(run.velocities).all() and (np.diff(run.poses[:, 0, 1]) < 0.0).all()
