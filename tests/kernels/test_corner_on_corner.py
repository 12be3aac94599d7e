"""Corner against corner: such a contact is neither lost nor a snag."""

from __future__ import annotations

import numpy as np
import pytest
from physics.helpers import box, rock
from physics.shapes import overlap

from rigdda import Block, Scene, Settings, Simulation

AWAKE = Settings(sleeping=False)


@pytest.mark.parametrize("shift", [0.0, 1e-9, -1e-9, 1e-3, -1e-3])
@pytest.mark.parametrize("turn", [0.0, np.pi / 4, 0.3])
def test_corners_that_meet_do_not_pass(turn, shift):
    """Two squares hit corner to corner at 20 m/s."""
    reach = np.sqrt(0.5)
    way = np.array([np.cos(turn), np.sin(turn)])
    across = shift * np.array([-way[1], way[0]])
    left = box(0.0, 0.0, angle=turn + np.pi / 4)
    place = (2.0 * reach + 0.31) * way + across
    right = box(*place, angle=turn + np.pi / 4, velocity=(*(-20.0 * way), 0.0))
    sim = Simulation(Scene(None, (left, right), rock(20.0), gravity=0.0), AWAKE)
    for _ in range(100):
        sim.step()
        assert overlap(sim, 0, 1) < 0.05  # the faces slide along each other, turning
    # in flight penetration is not pushed out: it would change the angular momentum
    assert sim.diagnostics.penetration < 0.08
    assert sim.velocities[0, :2] @ way < -0.3  # the first was struck


@pytest.mark.parametrize("clearance", [1e-6, 1e-3])
@pytest.mark.parametrize("speed", [0.5, 30.0])
def test_corners_that_miss_do_not_snag(speed, clearance):
    """A square passes close beside another, edge along edge and corner by corner."""
    still, moving = box(0.0, 0.0), box(-2.0, 1.0 + clearance, velocity=(speed, 0.0, 0.0))
    sim = Simulation(Scene(None, (still, moving), rock(20.0), gravity=0.0), AWAKE)
    sim.step(round(4.0 / speed / AWAKE.dt))
    assert sim.velocities == pytest.approx(np.array([[0, 0, 0], [speed, 0, 0]]), abs=1e-9)


def test_square_slides_off_a_row_of_squares():
    """Without friction it keeps its speed over the joints between equal squares."""
    row = [box(float(i), -0.5, fixed=True) for i in range(8)]
    slider = Block([(0.2, 0.0), (1.2, 0.0), (1.2, 1.0), (0.2, 1.0)], velocity=(3.0, 0.0, 0.0))
    sim = Simulation(Scene(None, (*row, slider), rock(0.0)), AWAKE)
    sim.step(300)
    assert sim.velocities[-1] == pytest.approx([3.0, 0.0, 0.0], abs=1e-3)
