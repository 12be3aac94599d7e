"""A small site of single blocks and groups, and outcomes made by hand."""

from __future__ import annotations

from rigdda import (
    BarrierOutcome,
    Consequences,
    Event,
    MeshOption,
    Outcome,
    Prices,
    Site,
    Source,
    Surface,
)
from rigdda.model.site_tables import BarrierZone, Motion, Road, Slope, Stretch

FREE = Prices(
    fence_base=0.0,
    fence=dict.fromkeys(("100", "250", "500", "1000"), 0.0),
    ditch={"rock": 0.0},
    ditch_base=0.0,
    embankment=0.0,
    concrete=0.0,
    removal=0.0,
)
"""Prices of zero."""

HARMLESS = Consequences(closure=0.0, clearing=0.0)
"""Rock on the road costs nothing."""


def cut(prices: Prices | None = None, consequences: Consequences | None = None) -> Site:
    """Return a cut of 20 m at 63 degrees with 8 m of soil before the road."""
    return Site(
        name="cut",
        description="For tests: small blocks, larger ones and groups from the top of a cut.",
        slope=Slope(
            points=((-10.0, 21.0), (0.0, 20.0), (10.0, 0.0), (18.0, -0.1), (66.0, -2.0)),
            toe=10.0,
            surfaces=(Stretch(10.0, 18.0, "soil"),),
        ),
        sources=(Source(name="face", band=(0.5, 2.5)), Source(name="foot", band=(6.0, 7.0))),
        events=(
            Event("small", 1.0, "face", area=(0.05, 0.3)),
            Event("block", 0.2, "face", area=(0.3, 1.0), design=True),
            Event("low", 0.5, "foot", area=(0.05, 0.1)),
            Event("group", 0.05, "face", area=(0.2, 0.4), number=(3, 4), width=4.0, design=True),
        ),
        road=Road(18.0, 26.0),
        barrier_zone=BarrierZone(4.0, 17.8),
        surfaces={
            "rock": Surface(32.0, restitution=0.4, rolling=0.1),
            "soil": Surface(30.0, restitution=0.2, rolling=0.1),
        },
        meshes=(
            MeshOption("light", 10.0, 60.0, {"small": 0.4}),
            MeshOption("heavy", 10.0, 120.0, {"small": 0.1, "block": 0.5}),
        ),
        prices=prices or Prices(),
        consequences=consequences or Consequences(),
        motion=Motion(duration=8.0, dt=0.01),
    )


def outcome(
    event: str = "small",
    volume: float = 0.0,
    *failed: bool,
    width: float = 0.5,
    held: float = 0.0,
    released: float = 1.0,
) -> Outcome:
    """Return an outcome in which so much came onto the road [m3] and these barriers failed."""
    return Outcome(
        event=event,
        width=width,
        released_mass=2600.0 * released / width,
        released_volume=released,
        road_volume=volume,
        reached=volume > 0.0,
        reach=(0.0, 20.0),
        debris_fraction=volume / released,
        debris_on_road=0.0,
        max_energy_on_road=0.0,
        run_out=(5.0, 5.0, 5.0),
        slope_fraction=1.0 - held,
        held_fraction=held,
        road_fraction=0.0,
        beyond_fraction=0.0,
        barriers=tuple(
            BarrierOutcome(
                hits=0,
                max_energy=0.0,
                total_energy=0.0,
                absorbed_energy=0.0,
                impact_heights=(),
                overtopped=0,
                failed=state,
                caught=0.0,
                state="failed" if state else "stands",
                displacement=0.0,
                road_area=0.0,
                thrust=0.0,
                resistance=1.0,
                left_height=1.0,
            )
            for state in failed
        ),
    )
