"""Grounds of the library, and what a release draws of them."""

import msgspec
import numpy as np
import pytest

from rigdda import BadInput, DoubtfulInput, Fence, Site, Surface, release, release_outcome
from rigdda.model.grounds import GROUNDS, OTHER, USUAL
from rigdda.model.place import Motion
from rigdda.model.realisation import FARTHEST
from rigdda.model.roughness import Roughness
from rigdda.model.terrain import Terrain

replace = msgspec.structs.replace
BENCH = Site.load("bench")
FENCE = (Fence(31.0, 3.0, energy_class=1000),)


def with_soil(site: Site, **values: float) -> Site:
    """Return a site with other values of all its surfaces."""
    surfaces = {name: replace(s, **values) for name, s in site.surfaces.items()}
    return replace(site, surfaces=surfaces)


EVEN = with_soil(BENCH, friction_sd_deg=0.0, restitution_sd=0.0, damping_sd=0.0)


@pytest.mark.parametrize("name", GROUNDS)
def test_every_ground_has_ranges_about_its_values_and_sources(name):
    ground, surface = GROUNDS[name], Surface(ground=name)
    for field in ("friction_deg", "restitution", "damping", "roughness"):
        span = getattr(ground, field)
        assert span.low <= span.typical <= span.high
        assert span.source
        assert getattr(surface, field) == span.typical
    assert surface.friction_sd_deg == ground.friction_sd_deg > 0.0
    assert Surface(ground=name, damping=0.7, friction_deg=41.0).damping == 0.7
    assert Surface(ground=name, friction_deg=41.0).restitution == ground.restitution.typical


def test_a_surface_without_a_ground_is_plain():
    plain = Surface()
    assert (plain.friction_deg, plain.restitution, plain.damping) == (30.0, 0.0, None)
    assert not plain.varies


def test_unknown_grounds_are_refused_with_those_that_are_known():
    with pytest.raises(BadInput, match=r"ground = 'swamp': .*meadow"):
        Surface(ground="swamp")
    assert {*USUAL.values(), OTHER} <= set(GROUNDS)


def test_a_site_that_states_no_damping_takes_that_of_its_ground_and_says_so():
    bare = {name: Surface(damping=None) for name in BENCH.surfaces}
    with pytest.warns(DoubtfulInput, match=r"surfaces\.(rock|soil|asphalt)\.damping is not given"):
        site = replace(BENCH, surfaces=bare)
    for name, surface in site.surfaces.items():
        assert surface.damping == GROUNDS[USUAL[name]].damping.typical
    stated = replace(BENCH, surfaces=bare, motion=Motion(damping=0.4))  # warnings are errors here
    assert all(surface.damping is None for surface in stated.surfaces.values())
    assert stated.realise((), 1, "block").damping == 0.4


def test_saved_sites_keep_their_grounds(tmp_path):
    BENCH.save(tmp_path / "bench.toml")
    assert Site.load(tmp_path / "bench.toml") == BENCH


def test_strengths_scatter_as_they_are_asked_to():
    sd = {"friction_sd_deg": 3.0, "restitution_sd": 0.02, "damping_sd": 0.1}
    site = with_soil(BENCH, **sd)
    scenes = [site.realise((), seed, "block") for seed in range(400)]
    for name, surface in site.surfaces.items():
        drawn = [scene.surfaces[name] for scene in scenes]
        for field, spread in zip(("friction_deg", "restitution", "damping"), sd.values(),
                                 strict=True):  # fmt: skip
            off = np.array([getattr(s, field) for s in drawn]) - getattr(surface, field)
            assert abs(off.mean()) < 4.0 * spread / 20.0
            assert off.std() == pytest.approx(spread, rel=0.15)
            assert np.abs(off).max() <= FARTHEST * spread + 1e-9
    rock = scenes[3].surfaces["rock"]
    assert site.realise(FENCE, 3, "block").surfaces["rock"] == rock  # whatever the layout
    assert site.realise((), 3, "block").surfaces["rock"] == rock


def test_blocks_do_not_depend_on_how_the_ground_varies():
    rough = with_soil(EVEN, roughness=0.1)
    for site in (BENCH, rough):
        one, other = EVEN.draw(5, "group"), site.draw(5, "group")
        for a, b in zip(one.blocks, other.blocks, strict=True):
            assert np.array_equal(a.vertices, b.vertices)
            assert a.velocity == b.velocity


def test_pits_are_below_the_ground_but_where_barriers_stand():
    rough = with_soil(EVEN, roughness=0.1)
    bare, built = (rough.realise(layout, 2, "block") for layout in ((), FENCE))
    smooth = EVEN.profile
    x = np.linspace(-14.0, 84.0, 2000)
    level = np.array([smooth.height(at) for at in x])
    ground = np.array([bare.ground.height(at) for at in x])
    assert (ground <= level + 1e-9).all()
    pits = np.array([p for p in bare.ground.points if p[1] < smooth.height(p[0]) - 1e-9])
    depth = np.array([smooth.height(at) - y for at, y in pits])
    assert len(depth) > 40
    assert np.sqrt((depth**2).mean()) == pytest.approx(0.1, rel=0.3)
    for corner in smooth.points:
        assert (np.abs(bare.ground.points - corner).sum(axis=1) < 1e-12).any()
    fence = FENCE[0]
    stands = (x > fence.x) & (x < fence.x + fence.extent)
    other = np.array([built.ground.height(at) for at in x])
    assert np.allclose(other[stands], level[stands])
    spacing = bare.roughness.spacing
    away = (x < fence.x - spacing) | (x > fence.x + fence.extent + spacing)
    assert np.array_equal(other[away], ground[away])
    again = rough.realise((), 3, "block").ground
    assert again.points.shape == bare.ground.points.shape
    assert not np.array_equal(again.points, bare.ground.points)


def test_a_face_and_short_pieces_of_the_ground_have_no_pits():
    ground = Terrain([(0.0, 10.0), (1.0, 0.0), (1.2, 0.0), (20.0, 0.0)])
    rough = Roughness(0.5, {"rock": 0.1}, (1,)).applied(ground)
    inner = rough.points[(rough.points[:, 0] > 0.0) & (rough.points[:, 0] < 1.2)]
    assert len(inner) == 1  # the corner at the foot of the face
    assert len(rough.points) > 30


@pytest.mark.parametrize("layout", [(), FENCE])
def test_batches_give_what_single_releases_give(layout):
    site = with_soil(BENCH, roughness=0.08)
    for seed in range(3):
        for event in ("block", "group"):
            _, outcome = release(site, layout, seed, event)
            assert release_outcome(site, layout, seed, event) == outcome


def test_what_a_ground_takes_decides_how_far_rock_comes():
    """The same blocks on grounds of no and of much damping."""
    reached = []
    for damping in (0.0, 2.0):
        site = with_soil(EVEN, damping=damping)
        reached.append(np.mean([release_outcome(site, (), s, "small").run_out[2]
                                for s in range(40)]))  # fmt: skip
    assert reached[1] < reached[0] - 3.0
