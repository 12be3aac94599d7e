"""Single blocks that share arrays come down as they do in scenes of their own."""

from __future__ import annotations

import dataclasses
from itertools import product

import msgspec
import numpy as np
import pytest

import rigdda
from rigdda import BadInput, Block, Ditch, Embankment, Fence, Layout, Site, Wall, sites
from rigdda.dynamics.packing import NET, WALL, pack_interfaces
from rigdda.ground.surface import Interface
from rigdda.model.interfaces import ContactProperties
from rigdda.model.site_tables import Scatter
from rigdda.releases import Batch, SingleReleases, can_share

BENCH = sites.load("bench")
PUSHED = Embankment(31.0, 0.6, width=0.5, density=300.0)
LAYOUTS: dict[str, Layout] = {
    "nothing": (),
    "ditch and wall": (Ditch(25.0, 0.8, 2.5), Wall(31.0, 0.8)),
    "fence of a class": (Fence(31.0, 2.0, energy_class=100),),
    "fence that fails, embankment that is pushed away": (Fence(25.0, 2.0, capacity=2e4), PUSHED),
}


def varied(site: Site) -> Site:
    """Return a site on which all that may differ from release to release does."""
    pairs = (
        Interface("soil", "rock", 35.0, restitution=0.2),
        Interface("rock", "asphalt", 25.0, rolling=0.4, restitution_speed=6.0),
        Interface("asphalt", "soil", 28.0, restitution=0.1),
    )
    surfaces = dict(site.surfaces)
    surfaces["asphalt"] = rigdda.Surface(33.0, restitution=0.3)  # varies not
    surfaces["soil"] = msgspec.structs.replace(surfaces["soil"], restitution_speed=9.0)
    return msgspec.structs.replace(
        site,
        surfaces=surfaces,
        interfaces=pairs,
        scatter=Scatter(friction_deg=4.0),
    )


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("site", [BENCH, varied(BENCH)], ids=["bench", "varied"])
def test_outcomes_are_those_of_scenes(site, name):
    events = ("block", "small", "block, below bench")
    wanted = [(site, LAYOUTS[name], s, e) for s, e in product(range(8), events)]
    found = rigdda.release_many(wanted, 1)
    assert found == [rigdda.release(*job)[1] for job in wanted]
    states = {b.state for outcome in found for b in outcome.barriers}
    assert ({"failed", "pushed"} <= states) == ("fails" in name)


@pytest.mark.parametrize("name", sites.design_names())
def test_outcomes_are_those_of_scenes_on_every_site(name):
    site = sites.load(name)
    wanted = [(site, (), seed, e.name) for e in site.events for seed in range(6)]
    wanted = [job for job in wanted if len(site.draw(*job[2:]).blocks) == 1]
    for found, job in zip(rigdda.release_many(wanted, 1), wanted, strict=True):
        assert found == rigdda.release(*job)[1], job


@pytest.mark.parametrize("barriers", [(), (Fence(31.0, 3.0, capacity=1e6),)])
@pytest.mark.parametrize("site", [BENCH, varied(BENCH)], ids=["bench", "varied"])
def test_how_surfaces_meet(site, barriers):
    for seed in range(20):
        drawn = site.draw(seed, "block")
        scene = site.scene(drawn, barriers)
        properties = ContactProperties(site)
        properties.draw(drawn)
        wanted, names = pack_interfaces(scene, list(scene.surfaces)), len(scene.surfaces)
        tangents = np.vectorize(lambda angle: np.tan(np.radians(angle)))(properties.friction_deg)
        np.testing.assert_allclose(wanted["friction"][:names, :names], tangents, rtol=1e-15)
        for field in ("restitution", "rolling", "restitution_speed"):
            np.testing.assert_array_equal(wanted[field][:names, :names], getattr(properties, field))
        net = names + NET
        for fences in (wanted[net:][:1], wanted[:, net:][:, :1]):
            for field in ("friction", "restitution", "rolling"):
                assert (fences[field] == 0.0).all()
            assert (fences["restitution_speed"] == np.inf).all()
        if barriers:
            wall, own = names + WALL, list(scene.surfaces).index(scene.barrier_surface)
            for field in ("friction", "restitution", "restitution_speed"):
                found = wanted[field][wall, :names]
                np.testing.assert_array_equal(found, wanted[field][own, :names])
            rolling = wanted["rolling"]
            assert (rolling[wall] == 0.0).all() and (rolling[:, wall] == 0.0).all()
        least = min(surface.friction_deg for surface in scene.surfaces.values())
        assert properties.least_friction_deg == least


def test_what_takes_a_scene_is_left_to_one():
    drawn = BENCH.draw(0, "block")
    scene = BENCH.scene(drawn)
    assert can_share(BENCH, scene)
    single = SingleReleases(BENCH, [], scene)
    assert single.ending(drawn) is not None
    (block,) = drawn.blocks
    sunk = Block.sound(block.vertices - (0.0, 0.5), block.density, block.surface, block.velocity)
    assert single.ending(drawn._replace(blocks=(sunk,))) is None
    batch = Batch(BENCH, ())
    batch.ending(drawn)
    with pytest.raises(BadInput, match="overlaps the ground"):
        batch.ending(drawn._replace(blocks=(sunk,)))
    corners = [(0.0, 30.0), (2.0, 30.0), (1.0, 30.5), (1.0, 32.0)]
    bent = Block(corners, block.density, block.surface)
    assert single.ending(drawn._replace(blocks=(bent,))) is None
    rough = {name: msgspec.structs.replace(s, roughness=0.1) for name, s in BENCH.surfaces.items()}
    uneven = msgspec.structs.replace(BENCH, surfaces=rough)
    assert not can_share(uneven, uneven.realise((), 0, "block"))
    moving = (rigdda.GravityWall(31.0, 1.5),)
    assert not can_share(BENCH, BENCH.realise(moving, 0, "block"))


def test_order_changes_no_outcome():
    batch = Batch(BENCH, LAYOUTS["fence that fails, embankment that is pushed away"])
    releases = [(seed, "block") for seed in range(12)]
    found = batch.outcomes(releases)
    assert batch.outcomes(releases[::-1]) == found[::-1]
    assert [batch.outcome(*release) for release in releases] == found
    assert all(dataclasses.is_dataclass(outcome) for outcome in found)
