"""Grounds of the library, and what a release draws of them."""

import msgspec
import numpy as np
import pytest

from rigdda import (
    BadInput,
    DoubtfulInput,
    Embankment,
    Fence,
    GravityWall,
    Scene,
    Site,
    Surface,
    release,
    release_many,
    release_outcome,
    sites,
)
from rigdda.dynamics.packing import NET, pack_interfaces
from rigdda.envs import outcome_cache
from rigdda.envs.outcome_cache import Memory
from rigdda.ground.grounds import GROUNDS, OTHER, USUAL
from rigdda.ground.surface import Interface, smaller
from rigdda.ground.terrain import REACH, Roughness, Terrain
from rigdda.model.site import FARTHEST
from rigdda.model.site_tables import Motion
from rigdda.releases import Batch
from rigdda.validation.scenes import box

replace = msgspec.structs.replace
BENCH = Site.load("bench")
FENCE = (Fence(31.0, 3.0, energy_class=1000),)


def with_soil(site: Site, **values: float) -> Site:
    """Return a site with other values of all its surfaces."""
    surfaces = {name: replace(s, **values) for name, s in site.surfaces.items()}
    return replace(site, surfaces=surfaces)


EVEN = with_soil(BENCH, friction_sd_deg=0.0, restitution_sd=0.0, rolling_sd=0.0)


@pytest.mark.parametrize("name", GROUNDS)
def test_every_ground_has_ranges_about_its_values_and_sources(name):
    ground, surface = GROUNDS[name], Surface(ground=name)
    for field in ("friction_deg", "restitution", "rolling", "roughness"):
        span = getattr(ground, field)
        assert span.low <= span.typical <= span.high
        assert span.source
        assert getattr(surface, field) == span.typical
    assert surface.friction_sd_deg == ground.friction_sd_deg > 0.0
    assert surface.rolling_sd == ground.rolling_sd > 0.0
    assert surface.restitution_speed == ground.restitution_speed
    assert Surface(ground=name, rolling=0.7, friction_deg=41.0).rolling == 0.7
    assert Surface(ground=name, friction_deg=41.0).restitution == ground.restitution.typical


def test_a_surface_without_a_ground_is_plain():
    plain = Surface()
    assert (plain.friction_deg, plain.restitution, plain.rolling) == (30.0, 0.0, 0.0)
    assert plain.restitution_speed is None
    assert not plain.varies


def test_unknown_grounds_are_refused_with_those_that_are_known():
    with pytest.raises(BadInput, match=r"ground = 'swamp': .*meadow"):
        Surface(ground="swamp")
    assert {*USUAL.values(), OTHER} <= set(GROUNDS)


def bench(old: str, new: str) -> str:
    """Return the text of the site BENCH with one change."""
    text = sites.text("bench")
    assert text.count(old) == 1
    return text.replace(old, new)


def test_a_site_file_without_rolling_resistance_takes_that_of_the_usual_ground():
    bare = bench('[surfaces.rock]\nground = "hard_rock"\n', "[surfaces.rock]\n")
    with pytest.warns(
        DoubtfulInput, match=r"neither surfaces\.rock\.rolling nor \.ground .* 0\.05 "
    ):
        site = Site.parse(bare, "bench")
    assert site.surfaces["rock"].rolling == GROUNDS[USUAL["rock"]].rolling.typical
    stated = bare.replace("[surfaces.rock]\n", "[surfaces.rock]\nrolling = 0.0\n")
    assert Site.parse(stated, "bench").surfaces["rock"].rolling == 0.0  # warnings are errors here


@pytest.mark.parametrize("name", ["damping", "damping_sd"])
def test_files_with_damping_of_grounds_are_refused(name):
    text = bench("[surfaces.rock]\n", f"[surfaces.rock]\n{name} = 0.5\n")
    words = rf"^surfaces\.rock\.{name} = 0\.5: remove it: .* give `rolling`, or name a ground$"
    with pytest.raises(BadInput, match=words):
        Site.parse(text, "bench")
    table = f'[[interfaces]]\nfirst = "rock"\nsecond = "soil"\n{name} = 0.5\n\n[surfaces.rock]\n'
    with pytest.raises(BadInput, match=rf"^interfaces\[0\]\.{name} = 0\.5: remove it"):
        Site.parse(bench("[surfaces.rock]\n", table), "bench")


def test_damping_in_contact_is_refused():
    words = "damping_when = 'contact': .* give `rolling` to the surfaces, or use \"always\""
    with pytest.raises(BadInput, match=rf"^motion\.{words}"):
        Motion(damping=0.3)
    with pytest.raises(BadInput, match=f"^{words}"):
        Scene(None, (box(0.0, 0.5),), {"rock": Surface()}, damping=0.3, damping_when="contact")
    assert Motion(damping=0.3, damping_when="always").damping == 0.3
    assert (Motion().damping, Motion().damping_when) == (0.0, "contact")
    text = bench("[motion]\n", '[motion]\ndamping = 0.0\ndamping_when = "contact"\n')
    assert Site.parse(text, "bench") == BENCH
    for when in ("contact", "always"):
        assert Motion(0.0, when).damping_when == when


def test_a_pair_has_the_smaller_rolling_resistance_and_speed():
    one, other = Surface(rolling=0.3, restitution_speed=9.0), Surface(rolling=0.1)
    assert smaller(one, other) == smaller(other, one)
    assert smaller(one, other).rolling == 0.1
    assert smaller(one, other).restitution_speed == 9.0  # None is infinite
    assert smaller(one, replace(one, restitution_speed=5.0)).restitution_speed == 5.0
    assert smaller(other, other).restitution_speed is None


def test_an_interface_has_the_rolling_resistance_of_its_pair_unless_it_states_its_own():
    for stated, wanted in ((None, EVEN.surfaces["soil"].rolling), (0.2, 0.2), (0.0, 0.0)):
        pair = Interface("rock", "soil", 20.0, rolling=stated, restitution_speed=7.0)
        scene = replace(EVEN, interfaces=(pair,)).realise((), 1, "block")
        assert scene.interface("soil", "rock").rolling == wanted
        assert scene.interface("soil", "rock").restitution_speed == 7.0
    with pytest.raises(BadInput, match=r"interfaces\[0\]\.rolling = -1"):
        replace(EVEN, interfaces=(Interface("rock", "soil", rolling=-1.0),))


def test_packed_pairs_have_rolling_resistance_and_speed_but_fences_have_not():
    soil = replace(EVEN.surfaces["soil"], restitution_speed=8.0)
    scene = replace(EVEN, surfaces=EVEN.surfaces | {"soil": soil}).realise(FENCE, 1, "block")
    names = list(scene.surfaces)
    packed, rock, ground = pack_interfaces(scene, names), names.index("rock"), names.index("soil")
    assert packed["rolling"][rock, ground] == soil.rolling
    assert packed["restitution_speed"][rock, ground] == 8.0
    assert packed["restitution_speed"][rock, rock] == np.inf
    net = len(names) + NET
    for fences in (packed[net], packed[:, net]):
        assert (fences["rolling"] == 0.0).all() and (fences["friction"] == 0.0).all()
        assert (fences["restitution_speed"] == np.inf).all()


def test_rolling_resistance_scatters_within_its_range():
    site = with_soil(BENCH, rolling=0.5, rolling_sd=0.1)
    drawn = [site.realise((), s, "block").surfaces["rock"].rolling for s in range(100)]
    assert np.mean(drawn) == pytest.approx(0.5, abs=0.04)
    assert np.std(drawn) == pytest.approx(0.1, rel=0.3)
    wild = with_soil(BENCH, rolling=0.9, rolling_sd=0.5, friction_sd_deg=15.0)
    drawn = [wild.realise((), s, "block").surfaces["rock"].rolling for s in range(40)]
    assert max(drawn) == 1.0 and 0.0 <= min(drawn) < 0.5


def test_speeds_of_restitution_are_kept_in_files(tmp_path):
    site = with_soil(BENCH, restitution_speed=9.144)
    site.save(tmp_path / "site.toml")
    assert Site.load(tmp_path / "site.toml") == site
    for speed in (0.0, -1.0, "fast"):
        with pytest.raises(BadInput, match="restitution_speed"):
            Surface(restitution_speed=speed)


def test_saved_sites_keep_their_grounds(tmp_path):
    BENCH.save(tmp_path / "bench.toml")
    assert Site.load(tmp_path / "bench.toml") == BENCH
    text = (tmp_path / "bench.toml").read_text()
    (tmp_path / "meadow.toml").write_text(text.replace("hard_soil", "meadow"))
    meadow = Site.load(tmp_path / "meadow.toml").surfaces["soil"]
    assert meadow.rolling == GROUNDS["meadow"].rolling.typical
    assert meadow.restitution == BENCH.surfaces["soil"].restitution  # which the site states


def test_strengths_scatter_as_they_are_asked_to():
    sd = {"friction_sd_deg": 3.0, "restitution_sd": 0.02, "rolling_sd": 0.1}
    site = with_soil(BENCH, rolling=0.5, **sd)
    scenes = [site.realise((), seed, "block") for seed in range(400)]
    for name, surface in site.surfaces.items():
        drawn = [scene.surfaces[name] for scene in scenes]
        for field, spread in zip(("friction_deg", "restitution", "rolling"), sd.values(),
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
    fence = FENCE[0]
    stands = (x > fence.x) & (x < fence.x + fence.extent)
    other = np.array([built.ground.height(at) for at in x])
    assert np.allclose(other[stands], level[stands])
    near = REACH * bare.roughness.spacing
    away = (x < fence.x - near) | (x > fence.x + fence.extent + near)
    assert np.allclose(other[away], ground[away], atol=1e-12)
    assert not np.allclose(other[~away], ground[~away])
    again = rough.realise((), 3, "block").ground
    assert again.points.shape == bare.ground.points.shape
    assert not np.array_equal(again.points, bare.ground.points)


def test_a_face_has_no_pits():
    ground = Terrain([(0.0, 10.0), (1.0, 0.0), (20.0, 0.0)])
    rough = Roughness(0.5, {"rock": 0.1}, (1,)).applied(ground)
    face = rough.points[rough.points[:, 0] <= 1.0]
    assert np.array_equal(face, ground.points[:2])
    assert len(rough.points) > 30


@pytest.mark.parametrize("length", [0.05, 0.4, 1.0, 7.0])
def test_pits_do_not_depend_on_how_finely_the_ground_was_surveyed(length):
    x = np.arange(0.0, 60.0 + length, length)
    slope = np.column_stack([x, -0.5 * x])
    roughness = Roughness(0.8, {"rock": 0.1}, (7,))
    rough, coarse = (roughness.applied(Terrain(p)) for p in (slope, slope[[0, -1]]))
    at = np.linspace(1.0, 58.0, 500)
    levels = [np.interp(at, *ground.points.T) for ground in (rough, coarse)]
    assert np.abs(levels[0] - levels[1]).max() < 5e-3


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"spacing": 0.0}, r"roughness\.spacing = 0"),
        ({"spacing": float("nan")}, r"roughness\.spacing = nan"),
        ({"amplitude": 0.1}, r"roughness\.amplitude = 0\.1"),
        ({"amplitude": {"rock": -1.0}}, r"roughness\.amplitude\['rock'\] = -1"),
        ({"seed": 5}, r"roughness\.seed = 5"),
        ({"seed": (-1,)}, r"roughness\.seed = -1"),
    ],
)
def test_bad_roughness_is_refused(change, field):
    sound = {"spacing": 1.0, "amplitude": {"rock": 0.1}, "seed": (1,)}
    with pytest.raises(BadInput, match=field):
        Roughness(**(sound | change))
    with pytest.raises(BadInput, match="roughness = 'x'"):
        Scene(Terrain([(-9, 0), (9, 0)]), [box(0.0, 0.5)], roughness="x")


EMBANKMENT = (Embankment(27.0, 2.0, 1.0),)


@pytest.mark.parametrize("layout", [(), FENCE, EMBANKMENT])
def test_batches_give_what_single_releases_give(layout):
    """A batch writes each release into the arrays of the one before, whatever the order."""
    site = with_soil(BENCH, roughness=0.08)
    for event in ("block", "small"):
        batch = Batch(site, layout)
        for seed in (3, 0, 7, 1, 9, 2, 8, 5):
            _, outcome = release(site, layout, seed, event)
            assert batch.outcome(seed, event) == outcome, (event, seed)


def test_what_an_evaluation_remembers_is_what_it_computes_on_rough_ground(monkeypatch):
    """A block may lie in a pit, so that what a wall holds is not inferred but simulated."""
    site = with_soil(BENCH, roughness=0.3)
    wall = (GravityWall(31.0, 2.0, 0.9),)
    jobs = [(site, (), seed, name) for name in site.event_names for seed in range(20)]
    built = [(site, wall, seed, name) for _, _, seed, name in jobs]
    monkeypatch.setattr(outcome_cache, "bare_outcomes", Memory(4096))
    outcome_cache.outcomes(jobs)
    assert outcome_cache.outcomes(jobs).simulated == 0
    assert list(outcome_cache.outcomes(built)) == release_many(built)


def test_what_a_ground_takes_decides_how_far_rock_comes():
    """The same blocks on grounds of no and of much rolling resistance."""
    reached = []
    for rolling in (0.0, 0.5):
        site = with_soil(EVEN, rolling=rolling)
        reached.append(np.mean([release_outcome(site, (), s, "small").run_out[2]
                                for s in range(40)]))  # fmt: skip
    assert reached[1] < reached[0] - 3.0
