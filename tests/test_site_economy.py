"""What a layout and a release cost, against sums by hand."""

from __future__ import annotations

import msgspec
import pytest

import rigdda
from rigdda import (
    BadInput,
    Consequences,
    Ditch,
    Embankment,
    Fence,
    GravityWall,
    Mesh,
    Outcome,
    Prices,
    Site,
    Wall,
)
from rigdda.model.site_tables import Stretch

QUICK = Site.load("quick")
PRICES = QUICK.prices
replace = msgspec.structs.replace

LEVEL = replace(
    QUICK.slope,
    points=((-10.0, 45.0), (0.0, 45.0), (29.8, 0.0), (34.8, 0.0), (44.8, 0.0), (80.0, -1.0)),
)
FLAT = replace(
    QUICK,
    slope=LEVEL,
    sources=QUICK.sources[:1],
    events=QUICK.events[:2],
    surfaces={**QUICK.surfaces, "soil": QUICK.surfaces["rock"]},
)
"""A plane slope with level ground at its toe."""


def test_a_kind_has_a_life_of_its_own():
    prices = replace(PRICES, lives={"fence": 25.0})
    i = prices.interest
    assert prices.annuity("fence") == pytest.approx(i / (1.0 - (1.0 + i) ** -25.0))
    assert prices.annuity("ditch") == PRICES.annuity("ditch")
    # a fence that is bought again every 25 years costs as much as its annuity paid for ever
    bought = sum((1.0 + i) ** (-25.0 * n) for n in range(60))
    assert bought == pytest.approx(prices.annuity("fence") / i, rel=1e-6)


def test_access_is_one_and_a_half_per_sixty_metres():
    site = Site.load("quick")
    for x in (12.0, 20.0, 30.0, 34.0):
        h = max(site.profile.height(x) - site.profile.height(site.road.start), 0.0)
        assert site.access(x) == pytest.approx(1.0 + 1.5 * h / 60.0)


def test_annuity_pays_back_a_loan():
    rate, life = PRICES.interest, PRICES.life
    left = 1.0
    for _ in range(int(life)):
        left = left * (1.0 + rate) - PRICES.annuity("fence")
    assert left == pytest.approx(0.0, abs=1e-9)
    assert replace(PRICES, interest=0.0).annuity("fence") == pytest.approx(1.0 / life)
    assert PRICES.annual("fence") == pytest.approx(PRICES.annuity("fence") + 0.015)


def test_concrete_is_paid_by_the_cubic_metre():
    for kind in (Wall, GravityWall):
        assert FLAT.capital((kind(32.0, 2.0, 0.5),)) == pytest.approx(350.0)


def test_a_fence_costs_at_least_the_lowest_of_its_class():
    prices = [FLAT.capital((Fence(31.0, h, energy_class=1500),)) for h in (2.0, 3.0, 4.0)]
    assert prices == pytest.approx([300.0 + 420.0 * h for h in (3.0, 3.0, 4.0)])


def test_access_makes_barriers_dearer_with_height():
    x = 29.8 * (1.0 - 30.0 / 45.0)  # 30 m above the road
    assert FLAT.access(x) == pytest.approx(1.0 + 1.5 * 30.0 / 60.0)
    assert FLAT.access(34.0) == 1.0
    assert FLAT.capital((Wall(x, 2.0, 0.5),)) == pytest.approx(1.75 * 350.0)


def test_access_makes_every_kind_dearer():
    x = 29.8 * (1.0 - 30.0 / 45.0)  # 30 m above the road
    free = replace(FLAT, prices=replace(PRICES, access=0.0))
    for barrier in (
        Wall(x, 2.0, 0.5),
        GravityWall(x, 2.0, 0.8),
        Fence(x, 3.0, energy_class=1000),
        Ditch(x, 1.0, 3.0),
        Embankment(x, 2.0),
    ):
        assert FLAT.capital((barrier,)) == pytest.approx(1.75 * free.capital((barrier,)))


def test_a_ditch_is_priced_by_the_ground_that_it_is_cut_in():
    ditch = Ditch(30.0, 1.0, 3.0, 0.5)  # on level ground: a trapezoid of 3 m above, 2 m below
    assert FLAT.capital((ditch,)) == pytest.approx(20.0 + 40.0 * 2.5)
    soil = replace(FLAT, slope=replace(LEVEL, surfaces=(Stretch(29.9, 34.0, "soil"),)))
    assert soil.capital((ditch,)) == pytest.approx(20.0 + 15.0 * 2.5)
    both = replace(FLAT, slope=replace(LEVEL, surfaces=(Stretch(31.5, 34.0, "soil"),)))
    assert both.capital((ditch,)) == pytest.approx(20.0 + 27.5 * 2.5)


def test_the_side_of_a_ditch_is_that_of_the_flattest_ground():
    soil = replace(FLAT, slope=replace(LEVEL, surfaces=(Stretch(31.5, 34.0, "soil"),)))
    assert soil.ditch_side(30.0, 1.5) == 0.25
    assert soil.ditch_side(30.0, 1.6) == 0.67
    assert soil.ditch_side(32.0, 1.0) == 0.67


def test_an_embankment_is_paid_by_what_is_filled_in():
    dam = Embankment(30.0, 2.0, 1.0, 0.5)
    assert FLAT.capital((dam,)) == pytest.approx(80.0 * (2.0 * 1.0 + 0.5 * 4.0))


def test_mesh_costs_its_area_and_makes_events_rarer():
    mesh = (Mesh(34.0, "face"),)
    assert FLAT.capital(mesh) == pytest.approx(13.5 * 80.0)
    assert FLAT.rate("block") == pytest.approx(0.006)
    assert FLAT.rate("block", mesh) == pytest.approx(0.2 * 0.006)
    assert FLAT.rate("group", mesh) == pytest.approx(0.7 * 0.001)
    again = r"barriers\[1\]\.option = 'face': use each mesh option at most once: barriers\[0\] has"
    for use in (FLAT.capital, FLAT.annual, FLAT.realise, lambda two: FLAT.rate("block", two)):
        with pytest.raises(BadInput, match=again):
            use(mesh * 2)


def test_a_fence_is_priced_by_its_class():
    fence = Fence(32.0, 3.0, energy_class=500)
    assert FLAT.capital((fence,)) == pytest.approx(300.0 + 250.0 * 3.0)
    with pytest.raises(BadInput, match="only a certified fence has a price"):
        FLAT.capital((Fence(32.0, 3.0, 1e5),))


def test_a_layout_costs_a_year_what_its_parts_cost():
    layout = (Ditch(30.0, 1.0, 2.0), Wall(33.0, 1.0, 0.5), Mesh(2.0, "face"))
    each = sum(FLAT.capital((b,)) * PRICES.annual(b.kind) for b in layout)
    assert FLAT.annual(layout) == pytest.approx(each)
    assert FLAT.capital(()) == FLAT.annual(()) == 0.0
    assert FLAT.shed() == pytest.approx(25_000.0 * (PRICES.annuity("shed") + 0.005))


def test_harm_is_closure_by_days_and_clearing():
    road = Consequences(closure=50_000.0, clearing=300.0)
    days = 0.2 + 0.15 * 32.0**0.6
    assert days == pytest.approx(1.4)
    assert road.harm(32.0, True) == pytest.approx(50_000.0 * 1.4 + 300.0 * 32.0)
    assert road.harm(0.0, False) == 0.0


def outcome_of(layout, **change) -> Outcome:
    """Return the outcome of a release with other fields."""
    _, outcome = rigdda.release(FLAT, layout, 0, "block")
    fields = {name: getattr(outcome, name) for name in Outcome.__slots__}
    return Outcome(**{**fields, **change})


def test_the_bill_of_a_release_mends_what_failed_and_empties_what_holds():
    layout = (Mesh(2.0, "face"), GravityWall(31.0, 1.0, 0.5))
    found = outcome_of(layout)
    (wall,) = found.barriers
    fields = {name: getattr(wall, name) for name in type(wall).__slots__}
    price = FLAT.capital(layout[1:])
    still = {"road_volume": 0.0, "reached": False, "held_fraction": 0.5, "released_volume": 8.0}
    for failed, width, repair in ((False, 2.0, 0.0), (True, 2.0, 5.0), (True, 12.0, 12.0)):
        barriers = (type(wall)(**{**fields, "failed": failed}),)
        outcome = outcome_of(layout, **still, barriers=barriers, width=width)
        bill = FLAT.bill(layout, outcome)
        assert bill.harm == 0.0
        assert bill.repair == pytest.approx(repair * price + 100.0 * 4.0)


def test_a_wall_that_slid_onto_the_road_blocks_it():
    layout = (GravityWall(31.0, 1.0, 0.5),)
    found = outcome_of(layout)
    fields = {name: getattr(found.barriers[0], name) for name in type(found.barriers[0]).__slots__}
    still = {"road_volume": 0.0, "reached": False, "held_fraction": 0.0, "width": 2.0}
    assert found.barriers[0].road_area == 0.0
    for area, harm in ((0.0, 0.0), (0.2, FLAT.consequences.harm(5.0 * 0.2, True))):
        barrier = type(found.barriers[0])(**{**fields, "failed": True, "road_area": area})
        assert FLAT.bill(layout, outcome_of(layout, **still, barriers=(barrier,))).harm == harm


def test_the_bill_of_no_barrier_is_harm():
    outcome = outcome_of((), road_volume=2.0, reached=True, held_fraction=0.0)
    days = 0.2 + 0.15 * 2.0**0.6
    assert FLAT.bill((), outcome) == (pytest.approx(50_000.0 * days + 600.0), 0.0)


def test_volumes_are_areas_times_the_width():
    drawn = FLAT.draw(3, "group")
    _, outcome = rigdda.release(FLAT, (), 3, "group")
    area = 0.0
    for block in drawn.blocks:
        x, y = block.vertices.T
        area += 0.5 * abs(x @ [*y[1:], y[0]] - y @ [*x[1:], x[0]])
    assert outcome.event == "group" and outcome.width == 6.0
    assert outcome.released_volume == pytest.approx(6.0 * area)
    assert 0.0 <= outcome.road_volume <= outcome.released_volume * (1.0 + 1e-12)
    assert outcome.reached == (outcome.road_volume > 0.0)


def test_prices_have_their_source():
    assert Prices().source and Consequences().source
