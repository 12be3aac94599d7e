"""The constant is one barrier that fits, wherever there is room."""

from __future__ import annotations

import pytest
from valley import SITE, Valley

from rigdda import Fence
from rigdda.agents.designers import constant
from rigdda.agents.designers.constant import CONSTANTS, place
from rigdda.agents.designers.menu import Menu
from rigdda.barriers import KINDS
from rigdda.envs import DesignProblem


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("mesh", "removal")])
def test_every_kind_has_a_constant(kind: str) -> None:
    problem = DesignProblem(SITE, kinds=(kind,))
    (barrier,) = constant.constant(problem, Menu(problem))
    assert barrier.kind == kind and problem.fits((barrier,))


def test_the_best_constant_of_the_allowed_kinds_is_taken() -> None:
    problem = DesignProblem(SITE)
    (barrier,) = constant.constant(problem, Menu(problem))
    assert barrier.kind == CONSTANTS[0][0].kind


def test_a_constant_stands_as_near_to_its_share_as_it_may() -> None:
    problem = DesignProblem(SITE)
    menu, zone = Menu(problem), problem.zone
    wanted = zone.start + 0.5 * (zone.end - zone.start)
    (fence,) = place(menu, Fence(0.0, 2.0, energy_class=100), 0.5)
    assert fence.x == pytest.approx(wanted)
    (last,) = place(menu, Fence(0.0, 5.0, energy_class=8500), 1.0)
    assert last.x < problem.site.road.start - 9.0


def test_it_is_evaluated_once(valley: Valley) -> None:
    found = constant.design(valley, 300)
    assert found.simulations == 300 and found.origin == "start"
    assert constant.design(valley, 10**5).simulations == 4000
