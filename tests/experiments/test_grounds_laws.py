"""Laws of the ground and the road cut: what they change, and what is judged."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.grounds import __main__ as package
from experiments.grounds import laws, road_cut
from experiments.grounds.reach import SLOWED_AT
from experiments.grounds.study import RANGES, Field
from experiments.script import Number
from experiments.stale import stale
from rigdda import Site, Surface


@pytest.mark.parametrize("law", laws.LAWS)
def test_a_law_fixes_its_values_and_leaves_the_others_to_the_fit(law):
    field = laws.field(law, laws.DT)
    values = 0.5 * (field.low + field.high)
    ground = field.ground(values)
    assert set(field.names) == set(laws.PARAMETERS) - set(laws.LAWS[law])
    assert ground.restitution_speed == laws.LAWS[law]["restitution_speed"]
    assert (ground.rolling > 0.0) == ("rolling" in field.names)
    site = field.site(field.slope, "soil", values)
    assert site.surfaces["soil"] == ground and site.motion.dt == laws.DT


def test_all_sets_are_within_the_ranges_of_the_study():
    found = laws.sets(laws.QUICK_SETS)
    low, high = np.array([RANGES["blocks"][name] for name in laws.PARAMETERS]).T
    assert found.shape == (laws.QUICK_SETS, 3)
    assert (found >= low).all() and (found <= high).all()
    assert (found == laws.sets(laws.QUICK_SETS)).all()


def test_restitution_of_the_study_falls_with_speed_in_all_its_cases():
    field = Field("blocks")
    values = 0.5 * (field.low + field.high)
    assert field.names == tuple(RANGES["blocks"])
    assert field.ground(values).restitution_speed == SLOWED_AT


@pytest.mark.parametrize("rolling", [0.0, 0.3])
def test_a_slab_on_a_plane_keeps_the_speed_of_coulomb(rolling):
    ground = Surface(50.0, restitution=0.4, rolling=rolling, restitution_speed=SLOWED_AT)
    assert laws.slab_speed(ground) == pytest.approx(1.0, abs=laws.BAR)


def test_the_road_cut_is_changed_where_it_should_be():
    site = Site.load(road_cut.SITE)
    for rolling in road_cut.ROLLING:
        found = road_cut.changed(site, (3.0, 4.0), 26.0, rolling)
        assert all(source.aspect == (3.0, 4.0) for source in found.sources)
        assert found.surfaces["weathered_rock"].friction_deg == 26.0
        assert found.surfaces["talus"].friction_deg == site.surfaces["talus"].friction_deg
        own = [surface.rolling for surface in found.surfaces.values()]
        before = [surface.rolling for surface in site.surfaces.values()]
        assert own == (before if rolling == "library" else [0.0] * len(own))


def combinations_with(stays: tuple[float, ...]) -> list[dict]:
    """Return a table of the road cut in which these shares stay, from low to high friction."""
    site = Site.load(road_cut.SITE)
    return [
        road_cut.case(aspect, friction, rolling, site)
        | {"stays": share, "stays_low": share - 0.05, "stays_high": share + 0.05}
        for aspect in road_cut.ASPECTS
        for rolling in road_cut.ROLLING
        for friction, share in zip(road_cut.FRICTIONS, stays, strict=True)
    ]


def test_a_share_that_falls_with_friction_is_found():
    assert road_cut.fall(combinations_with((0.1, 0.2, 0.3, 0.4))) < 0.0
    assert road_cut.fall(combinations_with((0.3, 0.3, 0.28, 0.3))) < 0.0  # by chance
    wrong = road_cut.fall(combinations_with((0.4, 0.3, 0.2, 0.1)))
    assert wrong == pytest.approx(0.3 - np.hypot(0.05, 0.05))


def test_slabs_stay_more_often_on_rough_rock():
    site = Site.load(road_cut.SITE)
    smooth, rough = (
        road_cut.shares(road_cut.changed(site, (3.0, 4.0), friction, "library"), 40)
        for friction in (road_cut.FRICTIONS[0], road_cut.FRICTIONS[-1])
    )
    assert smooth["stays_high"] < rough["stays_low"]


def test_the_tables_note_their_kernels(tmp_path, monkeypatch):
    monkeypatch.setattr(laws, "LAWS", {"none": laws.LAWS["none"]})
    monkeypatch.setattr(laws, "best", lambda law, count, releases: np.array([40.0, 0.3]))
    monkeypatch.setattr(laws, "own_bench", lambda law, releases: (float("nan"), np.zeros(0)))
    for name in ("QUICK_AGAIN", "QUICK_BENCH"):
        monkeypatch.setattr(laws, name, 6)
    monkeypatch.setattr(road_cut, "QUICK_RELEASES", 4)
    assert isinstance(laws.run(True, tmp_path), Number)
    assert isinstance(road_cut.run(True, tmp_path), Number)
    assert (tmp_path / "road_cut.png").exists()
    assert {path.name for path in tmp_path.glob("*.csv")} >= {"laws.csv", "road_cut.csv"}
    assert list(stale(tmp_path)) == []


def test_the_package_runs_all_steps_and_returns_the_first_miss(tmp_path, monkeypatch):
    numbers = [Number("a", 1.0), Number("b", 2.0, high=1.0), Number("c", 3.0)]
    steps = {n.what: lambda quick, out, n=n: n for n in numbers}
    monkeypatch.setattr(package, "STEPS", steps)
    assert package.run(True, tmp_path).what == "b"
    monkeypatch.setattr(package, "STEPS", {k: steps[k] for k in ("c", "a")})
    assert package.run(True, tmp_path).what == "c"
