"""Checks of fences, walls, embankments and ditches against calculations by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from rigdda import Ditch, Embankment, Fence, GravityWall, Site
from rigdda.agents.designers import rule
from rigdda.agents.designers.menu import Menu
from rigdda.app.barrier_checks import LayoutChecks, check_layout
from rigdda.app.reports.design_report import check_notes
from rigdda.barriers.base import surfaces_below
from rigdda.envs import DesignProblem, design_envelope
from rigdda.envs.barrier_formulas import (
    PRESSURE_ON_ROCK,
    PRESSURE_ON_SOIL,
    BarrierCheck,
    Base,
    checks_of,
    mean_scene,
)
from rigdda.envs.fence_checks import demand_at
from rigdda.envs.ritchie_ditch import RitchieDitch
from rigdda.model.existing import Existing

KINDS = ("fence", "ditch", "embankment", "gravity_wall")


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return DesignProblem("verge", kinds=KINDS)


pytestmark = pytest.mark.usefixtures("few_blocks")


def own(checks: LayoutChecks, kind: str) -> dict[str, BarrierCheck]:
    return {check.check: check for check in checks.table if kind in check.barrier}


def test_a_fence_is_checked_with_the_demand_where_it_stands(problem: DesignProblem) -> None:
    fence = Fence(7.0, 3.0, energy_class=500)
    checks = own(check_layout(problem, (fence,)), "fence")
    site = problem.site
    found = demand_at(design_envelope.of(site, problem.zone), site.rule, 7.0)
    assert found is not None
    energy = checks["energy"]
    assert energy.demand == pytest.approx(1.2e-3 * found.energy()) and energy.capacity == 500.0
    assert checks["height"].demand == pytest.approx(found.height())
    assert checks["height"].capacity == 3.0
    long = checks["elongation"]
    assert (long.demand, long.capacity) == pytest.approx((1.3 * 3.5, 12.0 - 7.2))
    assert long.use == pytest.approx(4.55 / 4.8) and long.satisfied


def test_what_a_fence_stops_does_not_reach_what_is_below_it() -> None:
    problem = DesignProblem("quick", kinds=KINDS)
    first, second = Fence(18.3, 1.0, energy_class=1000), Fence(26.0, 4.0, energy_class=500)
    alone = check_layout(problem, (second,)).fences[0].demand
    behind = check_layout(problem, (first, second)).fences[1].demand
    assert alone.hard.passing > 50.0
    assert behind.hard.passing < 0.6 * alone.hard.passing


def wall_of(problem: DesignProblem) -> GravityWall:
    found = Menu(problem).nearest(GravityWall(9.0, 1.5, 1.0), 9.0)
    assert isinstance(found, GravityWall)
    return found


def test_a_wall_is_checked_by_hand_formulas(problem: DesignProblem) -> None:
    wall = wall_of(problem)
    checks = own(check_layout(problem, (wall,)), "gravity wall")
    site = problem.site
    demand = demand_at(design_envelope.of(site, problem.zone), site.rule, wall.x)
    assert demand is not None
    base = Base.of(problem.site, wall)
    area = wall.height * wall.thickness
    assert base.weight == pytest.approx(9.81 * 2400.0 * area, rel=0.1)  # sloping ground below it
    m, v = demand.hard.design_mass, demand.hard.design_speed()
    mass = base.weight / 9.81 * 5.0
    moves = (1.0 + base.restitution) * m * v / (m + mass)
    load = 0.5 * mass * moves**2 / 0.1 / 5.0  # over 0.1 m, per metre of an element of 5 m
    assert checks["sliding, impact"].demand == pytest.approx(1e-3 * load)
    assert checks["sliding, impact"].capacity == pytest.approx(1e-3 * base.friction * base.weight)
    lever = min(demand.hard.design_height(), wall.height)
    assert checks["overturning, impact"].demand == pytest.approx(1e-3 * load * lever)
    rights = base.weight * wall.thickness / 2.0
    assert checks["overturning, impact"].capacity == pytest.approx(1e-3 * rights)
    active = math.tan(math.radians(45.0 - 19.0)) ** 2
    thrust = 0.5 * active * 18e3 * wall.height**2
    assert checks["sliding, rock"].demand == pytest.approx(1e-3 * thrust)
    assert checks["overturning, rock"].demand == pytest.approx(1e-3 * thrust * wall.height / 3.0)
    pressed = wall.thickness - 2.0 * thrust * wall.height / 3.0 / base.weight
    assert checks["bearing, rock"].demand == pytest.approx(1e-3 * base.weight / pressed)
    assert checks["bearing, rock"].capacity in (1e-3 * PRESSURE_ON_ROCK, 1e-3 * PRESSURE_ON_SOIL)
    assert checks["sliding, rock"].limit == pytest.approx(1.0 / 1.5)


@pytest.mark.parametrize("name", ["bench", "narrow", "talus", "quick"])
def test_checks_use_the_mean_strength_of_the_ground(name: str) -> None:
    """Not that of a release, which varies by several degrees."""
    site = Site.load(name)
    wall = Menu(DesignProblem(site)).nearest(GravityWall(9.0, 1.5, 1.0), site.barrier_zone.end)
    assert isinstance(wall, GravityWall)
    angles = {surface.friction_deg for surface in site.surfaces.values()}
    base = Base.of(site, wall)
    scene = mean_scene(site, (wall,))
    assert scene.terrain is not None
    assert base.friction > 0.0  # else the angle of friction is not known
    angle = math.degrees(math.atan(base.friction))
    angle += max(wall.base_inclination(scene.terrain, scene.outline(0)), 0.0)
    assert min(abs(angle - one) for one in angles) < 1e-9
    assert base.restitution in {s.restitution for s in site.surfaces.values()}
    assert any(surface.friction_sd_deg > 0.0 for surface in site.surfaces.values())


def test_what_is_not_checked_is_told() -> None:
    problem = DesignProblem("talus", kinds=KINDS)
    dam = Menu(problem).nearest(Embankment(90.0, 4.0, 1.0), 90.0)
    assert dam is not None
    (line,) = (w for w in check_notes(check_layout(problem, (dam,))) if "penetration" in w)
    assert dam.label in line
    ditch = Ditch(6.0, 1.0, 3.0)
    for rise, outside in ((30.0, False), (60.0, True)):
        site = cut_of(rise)
        table = tuple(checks_of(site, ditch, None))
        told = [w for w in check_notes(LayoutChecks((), table, ())) if "not verified" in w]
        assert len(told) == outside


def cut_of(rise: float) -> Site:
    """A site with a cut of 55 degrees of this height [m]."""
    site = Site.load("quick")
    foot = site.slope.toe
    run_ = rise / math.tan(math.radians(55.0))
    points = ((foot - run_ - 20.0, rise), (foot - run_, rise), (foot, 0.0), (foot + 80.0, -1.0))
    return msgspec.structs.replace(
        site, slope=msgspec.structs.replace(site.slope, points=points, surfaces=())
    )


def test_an_embankment_slides_but_does_not_overturn() -> None:
    problem = DesignProblem("talus", kinds=KINDS)
    dam = Menu(problem).nearest(Embankment(90.0, 4.0, 1.0), 90.0)
    assert isinstance(dam, Embankment)
    checks = own(check_layout(problem, (dam,)), "embankment")
    assert checks.keys() == {"height", "sliding, impact"}
    taller = msgspec.structs.replace(dam, width=2.0)
    if problem.fits((taller,)):
        more = own(check_layout(problem, (taller,)), "embankment")
        assert more["sliding, impact"].use < checks["sliding, impact"].use


def test_ritchie_stands_beside_a_ditch(problem: DesignProblem) -> None:
    ditch = Menu(problem).nearest(Ditch(6.0, 1.0, 3.0), 6.0)
    assert isinstance(ditch, Ditch)
    checks = own(check_layout(problem, (ditch,)), "ditch")
    ritchie = RitchieDitch.of(problem.site)
    assert (checks["width"].demand, checks["width"].capacity) == (ritchie.width, ditch.width)
    assert (checks["depth"].demand, checks["depth"].capacity) == (ritchie.depth, ditch.depth)
    assert "Ritchie" in checks["width"].note


def test_a_barrier_that_nothing_reaches_is_named(
    problem: DesignProblem, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = design_envelope.of(problem.site, problem.zone)
    none = [
        msgspec.structs.replace(event, passing=[0] * len(usual.stations)) for event in usual.events
    ]
    empty = msgspec.structs.replace(usual, events=none)
    monkeypatch.setattr(design_envelope, "of", lambda *_, **__: empty)
    found = check_layout(problem, (Fence(7.0, 3.0, energy_class=500),))
    assert found.table == () and found.idle == ("fence 500 kJ, 3.0 m high, at 7.0 m",)


def test_the_rule_and_the_checks_agree_behind_an_existing_fence() -> None:
    site = Site.load("quick")
    for removable in (False, True):
        old = Existing(kind="fence", x=18.3, height=2.0, energy_class=500, removable=removable)
        problem = DesignProblem(msgspec.structs.replace(site, existing=(old,)), kinds=KINDS)
        found = rule.answer(problem)
        assert found.name == rule.RULE_NAME and found.check is not None
        sheets = {sheet.fence: sheet for sheet in check_layout(problem, found.layout).fences}
        sheet = sheets[found.layout[0]]
        assert sheet.uses == pytest.approx(found.check.uses)


def test_few_blocks_are_said_to_be_too_few() -> None:
    problem = DesignProblem("quick", kinds=KINDS)
    found = rule.answer(problem).check
    assert found is not None
    hard = found.demand.hard
    assert hard.enough and "95 % quantile, " in found.rows()[3].basis
    few = replace(found, demand=replace(found.demand, hard=hard._replace(passing=19.0)))
    assert few.rows()[3].basis == "largest of 19, too few for a 95 % quantile"


def test_an_existing_fence_keeps_blocks_off_and_is_checked() -> None:
    site = Site.load("quick")
    old = Existing(kind="fence", x=18.3, height=1.0, energy_class=1000)
    stands = msgspec.structs.replace(site, existing=(old,))
    new = Fence(26.0, 4.0, energy_class=500)
    alone = check_layout(DesignProblem(site, kinds=KINDS), (new,))
    behind = check_layout(DesignProblem(stands, kinds=KINDS), (new,))
    assert [c.barrier.startswith("existing") for c in behind.table] == 3 * [True] + 3 * [False]
    assert behind.fences[1].demand.hard.passing < 0.6 * alone.fences[0].demand.hard.passing
    zone = site.barrier_zone
    bare = design_envelope.of(site, zone), design_envelope.of(stands, zone)
    assert bare[0].events == bare[1].events  # without a layout, nothing stands


@pytest.mark.parametrize("name", ["talus", "verge", "narrow"])
def test_a_structure_on_a_slope_slides_under_less_than_on_level_ground(name: str) -> None:
    """From statics, the horizontal thrust is W tan(phi - b)."""
    site = Site.load(name)
    zone = site.barrier_zone
    x = 0.5 * (zone.start + zone.end)
    for barrier in (
        GravityWall(x, 1.0, 1.0),
        Embankment(x, 1.0, width=1.0, side_slope=0.5),
    ):
        scene = mean_scene(site, (barrier,))
        assert scene.terrain is not None
        outline = scene.outline(0)
        ends = outline[:, 0].min(), outline[:, 0].max()
        fall = -np.diff(np.interp(ends, *site.profile.points.T))[0] / (ends[1] - ends[0])
        own = scene.barrier_surface if isinstance(barrier, GravityWall) else scene.fill
        below = surfaces_below(scene.terrain, outline)
        angle = math.radians(min(scene.friction_deg(own, one) for one in below))
        right = math.tan(max(angle - math.atan(fall), 0.0))
        assert Base.of(site, barrier).friction == pytest.approx(right, rel=1e-6, abs=1e-9)
