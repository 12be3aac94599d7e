"""What may be built where: slope, zone, road, gaps, sizes; and the nearest place for the rest."""

from __future__ import annotations

import math

import cases
import msgspec
import numpy as np
import pytest

from rigdda import (
    BadInput,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Layout,
    Mesh,
    Site,
    Wall,
    release,
)
from rigdda.envs.problem import DesignProblem

KINDS = ("fence", "ditch", "embankment", "gravity_wall", "wall", "mesh")


@pytest.fixture(scope="module")
def site() -> Site:
    return cases.cut()


@pytest.fixture(scope="module")
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site, kinds=KINDS)


@pytest.mark.parametrize(
    "layout",
    [
        (),
        (Fence(8.0, 3.0, energy_class=250),),
        (Fence(4.1, 2.0, energy_class=100), Fence(15.3, 3.0, energy_class=250)),
        (Ditch(10.0, 1.0, 3.0, side_slope=0.67), Embankment(13.5, 2.0)),
        (GravityWall(10.5, 2.0, 1.0), Wall(14.0, 2.0, 1.0), Mesh(1.5, "heavy")),
    ],
)
def test_sound_layouts_may_be_built(problem: DesignProblem, layout: Layout) -> None:
    assert problem.fits(layout)
    assert problem.check(reversed(layout)) == tuple(sorted(layout, key=lambda b: b.x))
    for seed in range(3):
        problem.site.realise(layout, seed)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        # slope: 63 degrees up to x = 10, level beyond
        ([Ditch(9.0, 0.5, 3.0, 0.67)], r"layout\[0\]\.x = 9\.0: .* at most 30 deg steep, not 34"),
        ([Embankment(7.5, 1.0)], r"layout\[0\]\.x = 7\.5: .* at most 25 deg steep"),
        ([GravityWall(8.0, 1.0)], r"layout\[0\]\.x = 8\.0: .* at most 30 deg steep, not 63\.4"),
        ([Wall(8.0, 1.0)], r"layout\[0\]\.x = 8\.0: .* at most 30 deg steep"),
        # zone: 4 to 17.8, without loose rock about 6 to 7
        ([Fence(3.5, 2.0, energy_class=100)], r"layout\[0\]\.x = 3\.5: keep all of it"),
        ([Fence(6.5, 2.0, energy_class=100)], r"layout\[0\]\.x = 6\.5: keep all of it.* or "),
        ([Wall(17.5, 1.0)], r"layout\[0\]\.x = 17\.5: keep all of it, up to 18\.5 m, within"),
        ([Embankment(15.5, 2.0)], r"layout\[0\]\.x = 15\.5: keep all of it"),
        # road at 18
        (
            [Fence(15.4, 3.0, energy_class=250)],
            r"x = 15\.4: give at most 15\.3: it deflects by up to",
        ),
        ([Fence(14.5, 4.0, energy_class=500)], r"x = 14\.5: .* the road begins at 18"),
        # sizes
        ([Wall(14.0, 5.5)], r"layout\[0\]\.height = 5\.5: .* at most 5$"),
        ([Wall(14.0, 2.0, 0.4)], r"layout\[0\]\.thickness = 0\.4"),
        ([GravityWall(14.0, 3.0, 1.0)], r"layout\[0\]\.thickness = 1\.0: give at least 1\.2"),
        ([Ditch(11.0, 3.5, 7.0, 0.67)], r"layout\[0\]\.depth = 3\.5"),
        ([Ditch(11.0, 1.0, 6.0)], r"layout\[0\]\.side_slope = 0\.25: give at least 0\.67"),
        ([Ditch(11.0, 1.0, 1.2, 0.67)], r"layout\[0\]: ditch width = 1\.2"),
        ([Fence(12.0, 2.0, 1e6)], r"layout\[0\]\.capacity = .*give its energy class"),
        # one another
        (
            [Wall(12.0, 1.0), Wall(13.4, 1.0)],
            r"layout\[1\]\.x = 13\.4: give at least 13\.5: 0\.5 m clear of the wall",
        ),
        (
            [Fence(11.0, 2.0, energy_class=100), Wall(13.5, 1.0)],
            r"layout\[1\]\.x = 13\.5: give at least 13\.7: 0\.5 m clear of the fence",
        ),
        # mesh
        ([Mesh(1.5, "golden")], r"layout\[0\]\.option = 'golden': choose one of heavy, light"),
        ([Mesh(9.5, "light")], r"layout\[0\]\.x = 9\.5: .* at most 2\.5"),
        ([Mesh(1.5, "light"), Mesh(1.5, "heavy")], "layout = 'several meshes': give at most one"),
        ([Wall(x, 1.0) for x in (11, 13, 15, 16.7)], "layout = '4 barriers': give at most 3"),
        ([(12.0, 1.0)], r"layout\[0\] = \(12\.0, 1\.0\): give barriers"),
    ],
)
def test_what_may_not_be_built_is_refused(
    problem: DesignProblem, layout: list, message: str
) -> None:
    assert not problem.fits(layout)
    with pytest.raises(BadInput, match=message) as caught:
        problem.check(layout)
    assert "\n" not in str(caught.value)


def test_kinds_and_zone_are_those_of_the_problem(site: Site) -> None:
    fences = DesignProblem(site, kinds=["fence"], zone=(10.0, 15.0))
    with pytest.raises(BadInput, match=r"layout\[0\]\.kind = 'wall': choose one of fence"):
        fences.check([Wall(12.0, 1.0)])
    assert fences.fits([Fence(12.0, 2.0, energy_class=100)])
    assert not fences.fits([Fence(9.0, 2.0, energy_class=100)])


def test_the_end_of_an_embankment_is_where_it_meets_the_ground(problem: DesignProblem) -> None:
    for site, stations in ((problem.site, (10.2, 12.0)), (Site.load("talus"), (60.0, 95.0))):
        place = DesignProblem(site).place
        for x in stations:
            dam = Embankment(x, 2.0)
            moved, _ = dam.build(site.profile, site.soil)
            ends = moved[:, 0].min(), moved[:, 0].max()
            assert place.works(dam) == pytest.approx(ends, abs=1e-6)


def test_the_nearest_place(problem: DesignProblem) -> None:
    place = problem.place
    wall, room = place.nearest(GravityWall(8.0, 1.0, 1.0), [])
    assert 9.4 < wall.x <= 10.0  # on the toe, half of it on the cut
    assert room == (wall.x, wall.x + 1.0)
    fence, room = place.nearest(Fence(17.0, 2.0, energy_class=100), [])
    assert (fence.x, room) == (pytest.approx(15.8), (fence.x, pytest.approx(18.0)))
    other, _ = place.nearest(Fence(15.0, 2.0, energy_class=100), [room])
    assert other.x + 2.2 + 0.5 == pytest.approx(fence.x)
    taken = [(0.0, 20.0)]
    assert place.nearest(Fence(12.0, 2.0, energy_class=100), taken) is None


def test_the_nearest_place_may_be_far() -> None:
    """On `quick` walls have room for a machine beside them only near the road."""
    place = DesignProblem("quick").place
    found = place.nearest(GravityWall(18.2, 1.69, 1.0), [])
    assert found is not None and found[0].x > 29.0
    dam, _ = DesignProblem("bench").place.nearest(Embankment(18.0, 2.0, 1.0), [])
    assert DesignProblem("bench").fits((dam,))


def test_a_ditch_gets_the_sides_and_the_depth_of_its_ground(problem: DesignProblem) -> None:
    ditch = problem.place.put(Ditch(0.0, 3.0, 3.0), 11.0)
    assert ditch.side_slope == 0.67
    assert ditch.depth == pytest.approx(0.5 * (2.0 / 0.67), abs=0.05)
    assert problem.fits([ditch])
    assert problem.place.put(Ditch(0.0, 3.0, 0.5), 11.0) is None
    rocky = msgspec.structs.replace(
        problem.site, slope=msgspec.structs.replace(problem.site.slope, surfaces=())
    )
    steep = DesignProblem(rocky).place.put(Ditch(0.0, 3.0, 3.0), 11.0)
    assert (steep.side_slope, steep.depth) == (0.25, 3.0)


def test_mesh_hangs_over_the_rock_that_it_holds(problem: DesignProblem) -> None:
    assert problem.place.mesh(0) == Mesh(1.5, "light")
    assert math.isfinite(problem.site.capital([problem.place.mesh(0)]))


def test_a_machine_needs_room_beside_works() -> None:
    """The upper bench of bench is 2 m wide: a fence may stand there, what is dug or cast not."""
    bench = DesignProblem("bench")
    assert bench.fits((Fence(14.5, 3.0, energy_class=1000),))
    for works in (GravityWall(14.2, 1.0, 0.5), Embankment(14.2, 0.5, 0.5)):
        with pytest.raises(BadInput, match="a machine has 3 m beside it"):
            bench.check((works,))
    assert bench.fits((GravityWall(31.0, 1.0, 0.5),))


def test_what_fits_beside_loose_rock_can_be_realised() -> None:
    """Both forgive rounding of the edge of a band."""
    verge = DesignProblem("verge")
    at = (Fence(verge.place.parts[0][0] - 5e-10, 3.0, energy_class=250),)
    assert verge.fits(at)
    assert verge.site.realise(at, 0, verge.site.event_names[0]).barriers


def test_all_of_a_gravity_wall_stands_on_ground_that_holds_it() -> None:
    """At 29.55 m its uphill corner is on the cliff of quick: it would slide down before any rock
    comes, though its ends are 20 deg from one another."""
    quick = DesignProblem("quick")
    with pytest.raises(BadInput, match=r"the ground is at most 28 deg steep, not 64\.5"):
        quick.check((GravityWall(29.55, 4.0, 1.9),))
    at = GravityWall(29.8, 4.0, 1.9)
    assert quick.fits((at,))
    run, _ = release(quick.site, (at,), 0, "block")
    assert np.hypot(*(run.outline(0, 0) - run.outline(0, 20)).T).max() < 0.01
    for vector in np.random.default_rng(3).uniform(-1.0, 1.0, (300, quick.size)):
        assert quick.fits(quick.decode(vector))


def test_a_gravity_wall_is_put_as_thick_as_it_needs() -> None:
    room = DesignProblem("verge").place
    put = room.put(GravityWall(0.0, 2.0, 0.5), 9.0)
    assert isinstance(put, GravityWall) and (put.height, put.thickness) == (2.0, 0.8)
    tall = room.put(GravityWall(0.0, 9.0, 0.5), 9.0)
    assert isinstance(tall, GravityWall) and (tall.height, tall.thickness) == (5.0, 2.0)
