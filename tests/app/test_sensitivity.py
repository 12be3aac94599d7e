"""Sensitivity analysis: indices of known functions, noise, shared releases, and a real process."""

from __future__ import annotations

import random
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest
from processes import png_size, refused, rig, rows, run

import rigdda
from rigdda import BadInput, Fence, Site, save_layout
from rigdda.app.uncertainty.parameters import (
    Parameter,
    Posterior,
    choose,
    ground,
    inputs,
    plausible,
    read_posterior,
    set_numbers,
    unvaried,
)
from rigdda.app.uncertainty.sensitivity import Response, analyse, of_function, places, plan
from rigdda.app.uncertainty.sensitivity import run as analyse_site
from rigdda.envs.cost import judge
from rigdda.files import UNFINISHED
from rigdda.geometry import polygon_properties
from rigdda.ground.grounds import GROUNDS
from rigdda.model import site_names
from rigdda.model.site_tables import MOST_OFTEN, Event

ISHIGAMI = [Parameter(name, -np.pi, np.pi) for name in "abc"]
ISHIGAMI_S1, ISHIGAMI_ST = (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437)  # a = 7, b = 0.1


def ishigami(x: np.ndarray) -> np.ndarray:
    a, b, c = x.T
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_sobol_indices_of_the_ishigami_function(seed: int) -> None:
    found = of_function(ishigami, ISHIGAMI, "sobol", 1024, seed)
    assert [one.first for one in found] == pytest.approx(ISHIGAMI_S1, abs=0.05)
    assert [one.index for one in found] == pytest.approx(ISHIGAMI_ST, abs=0.05)
    for one, true in zip(found, ISHIGAMI_ST, strict=True):
        assert one.low - 0.02 < true < one.high + 0.02
        assert one.noise == 0.0 and one.distinguishable


def test_sobol_indices_of_the_g_function() -> None:
    a = np.array([0.0, 1.0, 9.0])
    partial = 1.0 / (3.0 * (1.0 + a) ** 2)
    whole = np.prod(1.0 + partial) - 1.0
    total = [partial[i] * np.prod(1.0 + np.delete(partial, i)) / whole for i in range(3)]
    found = of_function(
        lambda x: np.prod((np.abs(4.0 * x - 2.0) + a) / (1.0 + a), axis=1),
        [Parameter(f"x{i}", 0.0, 1.0) for i in range(3)],
        "sobol",
        1024,
    )
    assert [one.first for one in found] == pytest.approx(partial / whole, abs=0.05)
    assert [one.index for one in found] == pytest.approx(total, abs=0.05)


def test_morris_of_a_linear_function_is_exact() -> None:
    ends = [Parameter("a", 2.0, 4.0), Parameter("b", 1.0, 100.0, True), Parameter("c", 0.0, 1.0)]
    found = of_function(lambda x: 3.0 * x[:, 0] - np.log10(x[:, 1]), ends, "morris", 8)
    assert [one.change for one in found] == pytest.approx([6.0, -2.0, 0.0])
    assert [one.index for one in found] == pytest.approx([6.0, 2.0, 0.0])
    assert [one.spread for one in found] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert [one.distinguishable for one in found] == [True, True, False]


@pytest.mark.parametrize("method, samples", [("morris", 20), ("sobol", 32)])
def test_noise_is_told_from_influence(method: str, samples: int) -> None:
    """An output of 100 releases of two events that depends on the first of four inputs only."""
    called, right, index, noise = 0, 0, 0.0, 0.0
    strata = np.repeat([0, 1], [80, 20])
    for seed in range(25):
        rng = np.random.default_rng(seed)
        cube = places(method, 4, samples, seed)  # type: ignore[arg-type]
        terms = rng.exponential(0.01, (len(cube), 100)) * (1.0 + 2.0 * cube[:, :1])
        response = Response(terms.sum(axis=1), terms, strata)
        found = analyse(method, cube, response, seed)  # type: ignore[arg-type]
        right += found[0].distinguishable
        called += sum(one.distinguishable for one in found[1:])
        assert found[0].change == pytest.approx(2.0, abs=0.4)
        index += sum(one.index for one in found[1:])
        noise += sum(one.noise for one in found[1:])
    assert right == 25
    assert called <= 8  # at most 5 % of 75 are expected
    assert index == pytest.approx(noise, rel=0.1)  # that of inputs without influence


def test_the_same_releases_have_no_noise_if_only_their_price_changes() -> None:
    cube = places("morris", 2, 10, 0)
    base = np.random.default_rng(0).exponential(0.01, 100)
    terms = base * (1.0 + cube[:, :1])
    response = Response(terms.sum(axis=1), terms, np.zeros(100, dtype=int))
    first, second = analyse("morris", cube, response, 0)
    assert first.change == pytest.approx(base.sum()) and first.noise < 0.1 * first.change
    assert first.distinguishable and second.index == 0.0 and not second.distinguishable


def test_prices_and_rates_share_releases_and_cost_what_they_cost_from_scratch() -> None:
    site, layout = Site.load("narrow"), (Fence(13.0, 2.0, energy_class=250),)
    inputs = choose(("rates", "prices"), site, layout)
    asked = plan(site, layout, inputs, "morris", 4, 40, 7)
    assert len(asked.sites) == 4 * (len(inputs) + 1) and len(asked.groups) == 1
    found = analyse_site(asked, None, lambda done, words: None)
    names = [output.name for output in found.outputs]
    assert names[0] == "Z" and any(name.startswith("P(failure)") for name in names)
    for i in (0, 7, len(asked.sites) - 1):
        own = asked.sites[i]
        jobs = [(own, layout, s, event) for event, drawn in asked.seeds.items() for s in drawn]
        afresh = judge(own, layout, rigdda.release_many(jobs), {}, {})
        assert found.outputs[0].response.values[i] == pytest.approx(afresh.objective, rel=1e-12)
        for output in found.outputs[1:]:
            kind, event = output.name.split(" of ", 1)
            table = afresh.reach if kind == "P(reach)" else afresh.failure
            assert output.response.values[i] == pytest.approx(table[event].probability)
    for index in found.indices[1]:
        assert index.index == 0.0  # prices do not change how often rock reaches the road


def test_only_the_ground_and_the_blocks_are_simulated_again() -> None:
    site = Site.load("narrow")
    asked = plan(site, (), choose((), site, ()), "sobol", 4, 20, 0)
    mechanical = [one for one in asked.inputs if not one.path.startswith(("cons", "prices"))]
    mechanical = [one for one in mechanical if not one.path.endswith(".rate")]
    assert len(asked.groups) <= 4 * (len(mechanical) + 2)
    assert len(asked.sites) == 4 * (len(asked.inputs) + 2)


def test_ranges_are_those_of_the_library() -> None:
    site = Site.load("talus")
    for parameter in ground(site):
        _, name, field = parameter.path.split(".")
        span = getattr(GROUNDS[site.surfaces[name].ground], field)
        assert parameter.low <= span.low and parameter.high >= span.high
    assert {p.path for p in plausible(site, ())["prices"]}.isdisjoint({"prices.level"})


def test_default_ranges_end_where_the_site_is_no_longer_valid() -> None:
    often = set_numbers(Site.load("quick"), ("events.block.rate",), (500.0,))
    known = {one.path: one for one in choose((), often, ())}
    assert known["events.block.rate"].low == pytest.approx(500.0 / 3.0)
    assert known["events.block.rate"].high == pytest.approx(MOST_OFTEN, rel=1e-6)
    for one in known.values():
        for place in np.linspace(0.0, 1.0, 4):
            set_numbers(often, one.paths, one.at(float(place)))
    at_limit = set_numbers(often, ("events.block.rate",), (MOST_OFTEN,))
    (rate,) = (one for one in choose(("rates",), at_limit, ()) if "block" in one.path)
    assert (rate.low, rate.high) == pytest.approx((MOST_OFTEN / 3.0, MOST_OFTEN))


def test_default_ranges_of_sizes_leave_the_blocks_of_a_band_their_room() -> None:
    text = site_names.text("quick")
    assert "[-10.0, 45.0]" in text
    site = Site.parse(text.replace("[-10.0, 45.0]", "[-0.5, 45.0]"), "quick")
    (size,) = (one for one in choose(("sizes",), site, ()) if one.path == "events.block.size")
    assert size.low == 0.5 and 1.0 < size.high < 2.0
    set_numbers(site, size.paths, (size.high,))
    with pytest.raises(BadInput, match="band"):
        set_numbers(site, size.paths, (1.001 * size.high,))


def test_a_limit_that_makes_the_site_invalid_is_named_with_its_input() -> None:
    site = Site.load("quick")
    with pytest.raises(BadInput, match=r"^--parameters = 'events.block.size = 1000': .*band"):
        choose(("events.block.size=1:1000",), site, ())
    with pytest.raises(BadInput, match="LOW:HIGH"):
        choose(("events.block.size=1:1_0",), site, ())


def test_sizes_are_factors_on_volumes() -> None:
    quick = Site.load("quick")
    larger = set_numbers(quick, ("events.block.size", "sources.mass.size"), (8.0, 8.0))
    assert larger.event("block").area == pytest.approx((1.2, 8.0))
    assert larger.source("mass").block_area == pytest.approx(8.0)
    dearer = set_numbers(quick, ("prices.level",), (2.0,))
    fence = (Fence(25.0, 2.0, energy_class=250),)
    assert dearer.capital(fence) == pytest.approx(2.0 * quick.capital(fence))


VOLUMES = {
    "power law": {"volume": (0.1, 10.0)},
    "lognormal": {"volume": (0.01, 100.0), "volume_median": 1.0, "volume_spread": 0.5},
    "surveyed": {"volumes": (0.1, 1.0, 10.0), "volume_shares": (0.0, 0.5, 1.0)},
}
"""Distributions of the volumes of an event."""


def with_volumes(**volumes: object) -> Site:
    """Return the site `quick` with other volumes of the single blocks."""
    quick = Site.load("quick")
    block = quick.events[0]
    own = Event(name="block", rate=block.rate, source=block.source, design=True, **volumes)
    return msgspec.structs.replace(quick, events=(own, *quick.events[1:]))


def volumes_of(site: Site, event: str = "block") -> np.ndarray:
    """Return the volumes of the blocks of 60 releases of an event [m3]."""
    drawn = (site.draw(seed, event).blocks for seed in range(60))
    areas = [polygon_properties(block.vertices)[0] for blocks in drawn for block in blocks]
    return np.array(areas) ** 1.5


@pytest.mark.parametrize("law", VOLUMES)
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_size_multiplies_the_volume_of_every_block(law: str, factor: float) -> None:
    site = with_volumes(**VOLUMES[law])
    (size,) = (one for one in choose(("sizes",), site, ()) if one.path == "events.block.size")
    assert (size.low, size.high) == (0.5, 2.0)
    scaled = set_numbers(site, size.paths, (factor,))
    assert volumes_of(scaled) == pytest.approx(factor * volumes_of(site), rel=1e-9)
    limits = np.array(site.event("block").volume_limits)
    assert scaled.event("block").volume_limits == pytest.approx(factor * limits)
    assert set_numbers(site, size.paths, (1.0,)) == site


def test_the_median_and_surveyed_volumes_have_the_factor_of_the_size() -> None:
    lognormal = set_numbers(with_volumes(**VOLUMES["lognormal"]), ("events.block.size",), (2.0,))
    assert lognormal.event("block").volume_median == 2.0
    assert lognormal.event("block").volume_spread == 0.5
    surveyed = set_numbers(with_volumes(**VOLUMES["surveyed"]), ("events.block.size",), (2.0,))
    assert surveyed.event("block").volumes == (0.2, 2.0, 20.0)
    assert surveyed.event("block").volume_shares == (0.0, 0.5, 1.0)


def measured() -> Site:
    """Return the site `quick` with measured blocks in its band."""
    quick = Site.load("quick")
    face = msgspec.structs.replace(quick.source("face"), edges=(1.2, 1.0, 0.8))
    events = tuple(
        msgspec.structs.replace(one, area=None) if one.source == "face" else one
        for one in quick.events
    )
    return msgspec.structs.replace(quick, sources=(face, *quick.sources[1:]), events=events)


def test_the_size_of_measured_blocks_is_that_of_their_source() -> None:
    site = measured()
    names = [one.path for one in choose(("sizes",), site, ())]
    assert names == ["sources.face.size", "sources.mass.size"]
    assert unvaried((), site, ()) == []
    scaled = set_numbers(site, ("sources.face.size",), (2.0,))
    assert volumes_of(scaled) == pytest.approx(2.0 * volumes_of(site), rel=1e-9)
    with pytest.raises(BadInput, match=r"name sources\.face\.size"):
        set_numbers(site, ("events.block.size",), (2.0,))


def test_factors_multiply_the_numbers_in_whatever_order_they_are_named() -> None:
    site = with_volumes(**VOLUMES["lognormal"])
    paths, values = ("events.block.size", "events.block.volume_median"), (2.0, 0.7)
    for order in (slice(None), slice(None, None, -1)):
        found = set_numbers(site, paths[order], values[order])
        assert found.event("block").volume_median == pytest.approx(1.4)
    paths, values = ("prices.level", "prices.concrete"), (2.0, 100.0)
    for order in (slice(None), slice(None, None, -1)):
        assert set_numbers(site, paths[order], values[order]).prices.concrete == 200.0


def test_numbers_that_cannot_be_varied_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    """Surveyed corners, and volumes that fill the range of what a site file accepts."""
    toppling = Site.load("toppling")
    paths = [one.path for one in inputs((), toppling, ())]
    assert paths and not [path for path in paths if path.endswith(".size")]
    told = "the volumes of the blocks of source 'mass', whose corners are surveyed"
    assert capsys.readouterr().out == f"note: not varied: {told}\n"
    inputs(("ground", "rates"), toppling, ())
    assert capsys.readouterr().out == ""
    shares = (0.0, 1.0)
    wide = with_volumes(volumes=(1e-6, 800.0), volume_shares=shares)
    size = choose(("sizes",), wide, ())[0]
    assert size.low == pytest.approx(1.0) and 1.0 < size.high < 2.0
    wide = with_volumes(volumes=(1e-6, size.high * 800.0), volume_shares=shares)
    assert "events.block.size" not in {one.path for one in choose(("sizes",), wide, ())}
    inputs(("sizes",), wide, ())
    told = "events.block.size, which has no other valid value on this site"
    assert capsys.readouterr().out == f"note: not varied: {told}\n"


@pytest.mark.parametrize(
    "name, named",
    [
        ("sizes", "sizes': name other numbers or groups: .* of source 'mass', whose corners"),
        ("events.mass.size=0.5:2", "leave it out: the blocks of source mass are surveyed"),
        ("sources.mass.size=0.5:2", "leave it out: the blocks of this source are surveyed"),
    ],
)
def test_surveyed_blocks_have_no_size(name: str, named: str) -> None:
    with pytest.raises(BadInput, match=named):
        inputs((name,), Site.load("toppling"), ())


def test_the_size_of_loose_blocks_is_that_of_their_events() -> None:
    with pytest.raises(BadInput, match=r"name events\.block\.size or events\.group\.size: events"):
        set_numbers(Site.load("quick"), ("sources.face.size",), (2.0,))


def test_a_posterior_is_one_input(tmp_path: Path) -> None:
    paths = ("surfaces.rock.rolling", "surfaces.rock.restitution")
    rng = np.random.default_rng(0)
    values = np.column_stack([rng.uniform(0.5, 1.0, 50), rng.uniform(0.2, 0.3, 50)])
    joint = Posterior.of(paths, values, np.ones(50))
    drawn = np.array([joint.at(u) for u in (np.arange(1000) + 0.5) / 1000])
    assert drawn.mean(axis=0) == pytest.approx(values.mean(axis=0))
    file = tmp_path / "posterior.csv"
    from rigdda.app.reports.tables import write_rows

    write_rows(file, joint.rows())
    read = read_posterior(file, Site.load("narrow"))
    assert read.paths == paths and (read.values == joint.values).all()
    low, high = read.interval(0.9)
    assert low == pytest.approx(np.quantile(values, 0.05, axis=0), abs=0.02)
    assert high == pytest.approx(np.quantile(values, 0.95, axis=0), abs=0.02)


@pytest.mark.parametrize(
    "text, named",
    [
        ("", "give a column weight"),
        ("weight\n1\n", "give a column weight"),
        ("weight,surfaces.rock.rolling\n", "give a column weight"),
        ("weight,surfaces.rock.rolling\n1,x\n", "give a column weight"),
        ("weight,surfaces.rock.rolling\n0,1\n", "weights above 0"),
        ("weight,surfaces.rock.rolling\n1,nan\n", "finite numbers"),
        ("weight,surfaces.clay.rolling\n1,1\n", "name a number of the site file"),
        ("weight,surfaces.rock.rolling\n1,500\n", "surfaces.rock.rolling = 500"),
        ("weight,surfaces.rock.rolling\n1,0_1\n", "give a column weight"),
        ("weight,a,a\n1,1,1\n", "a different name"),
    ],
)
def test_a_posterior_file_is_checked(text: str, named: str, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(text)
    line = refused("sensitivity", "narrow", "--posterior", "p.csv", folder=tmp_path)
    assert named in line
    line = refused("design", "narrow", "--posterior", "p.csv", folder=tmp_path)
    assert named in line


@pytest.mark.parametrize(
    "options, named",
    [
        (("--samples", 1), ("--samples", "1")),
        (("--method", "sobol", "--samples", 60), ("--samples = 60", "power of two", "64")),
        (("--method", "fast"), ("--method", "fast")),
        (("--releases", 3), ("--releases = 3", "8")),
        (("--parameters", "weather"), ("--parameters", "weather=LOW:HIGH")),
        (("--parameters", "ground", "--parameters", "ground"), ("name each number once",)),
        (("--parameters", "surfaces.rock.rolling=2:1"), ("LOW below HIGH",)),
        (("--parameters", "surfaces.rock.rolling=0.2:500"), ("surfaces.rock.rolling", "500")),
        (("--parameters", "events.none.rate=1:2"), ("events.none.rate", "name a number")),
        (("--posterior", "none.csv"), ("--posterior", "none.csv", "rigdda fit")),
        (("--layout", "none.toml"), ("none.toml",)),
    ],
)
def test_malformed_options_are_one_line(
    options: tuple[object, ...], named: tuple[str, ...], tmp_path: Path
) -> None:
    line = refused("sensitivity", "narrow", *options, folder=tmp_path)
    assert all(word in line for word in named), line
    assert list(tmp_path.iterdir()) == []


def test_a_barrier_without_room_for_larger_blocks_is_told() -> None:
    site = Site.load("quick")
    fence = (Fence(8.95, 1.0, energy_class=100),)
    site.realise(fence)
    with pytest.raises(BadInput, match=r"outside the loose rock.*smaller values of .*size"):
        plan(site, fence, choose(("sizes",), site, fence), "morris", 4, 20, 0)


COMMAND = ("sensitivity", "narrow", "--samples", 8, "--releases", 40, "--layout", "layout.toml")


@pytest.fixture(scope="module")
def analysed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("narrow")
    save_layout((Fence(13.0, 2.0, energy_class=250),), folder / "layout.toml")
    words = run(*COMMAND, "--seed", 3, "--out", "whole", folder=folder)
    return folder, words


def test_tables_and_picture_of_an_analysis(analysed: tuple[Path, str]) -> None:
    folder, words = analysed
    assert {p.name for p in (folder / "whole").iterdir()} == {
        "sensitivity.csv", "samples.csv", "tornado.png", "tornado.svg", "run.json",
    }  # fmt: skip
    table, points = rows(folder / "whole/sensitivity.csv"), rows(folder / "whole/samples.csv")
    z = [row for row in table if row["output"] == "Z"]
    assert len(points) == 8 * (len(z) + 1)
    mu = [float(row["mu_star"]) for row in z]
    assert mu == sorted(mu, reverse=True) and mu[0] > 0.0
    for row in z:
        low, high = float(row["mu_star_low"]), float(row["mu_star_high"])
        assert low <= float(row["mu_star"]) <= high
        told = f" {row['input'].removeprefix('consequences.')} "
        if row["input"].startswith("consequences"):
            assert told in words
    dear = next(row for row in z if row["input"] == "consequences.closure")
    assert dear["distinguishable"] == "yes" and float(dear["change"]) > 0.0
    width, height = png_size(folder / "whole/tornado.png")
    assert width > 1000 and height > 600
    assert max(len(line) for line in words.splitlines() if "─" in line) <= 80


@pytest.mark.slow
def test_a_killed_analysis_goes_on_and_ends_the_same(analysed: tuple[Path, str]) -> None:
    folder, _ = analysed
    dice, out = random.Random(5), folder / "killed"
    for least in sorted(dice.sample(range(1, 13), 2)):
        killed = rig(*COMMAND, "--seed", 3, "--out", "killed", folder=folder)
        while len(list((out / UNFINISHED).glob("[!.]*.z"))) < least:
            assert killed.poll() is None
            time.sleep(0.002)
        time.sleep(0.02 * dice.random())
        killed.kill()
        killed.communicate()
    words = run(*COMMAND, "--seed", 3, "--out", "killed", folder=folder)
    assert "from an interrupted run" in words
    for file in ("sensitivity.csv", "samples.csv"):
        assert (out / file).read_bytes() == (folder / "whole" / file).read_bytes()
    assert not (out / UNFINISHED).exists()
