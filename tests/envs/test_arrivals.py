"""Rates of arrivals: converted once to rates of releases, and refused where they are not."""

from __future__ import annotations

import json
import re
from pathlib import Path

import msgspec
import pytest
from light_site import LIGHT

import rigdda
from rigdda import BadInput, Site
from rigdda.app import cli
from rigdda.envs import DesignProblem, with_release_rates
from rigdda.envs.arrivals import ENOUGH, LEAST_RELEASES, MOST_RELEASES, release_rates
from rigdda.passages import passages
from rigdda.seeds import NO_BARRIERS


def arriving(site: Site, *names: str, **values: float) -> Site:
    events = tuple(
        msgspec.structs.replace(e, rate_of="arrival", **values) if e.name in names else e
        for e in site.events
    )
    return msgspec.structs.replace(site, events=events)


@pytest.fixture(scope="module")
def site() -> Site:
    return arriving(LIGHT, "block")


def test_the_rate_of_releases_is_that_of_arrivals_over_their_probability(site: Site) -> None:
    (rate,) = release_rates(site)
    n = rate.chance.releases
    seeds = range(NO_BARRIERS, NO_BARRIERS + n)
    reached = [rigdda.release(site, (), seed, "block")[1].reached for seed in seeds]
    p = sum(reached) / n
    assert 0.0 < p < 1.0 and LEAST_RELEASES <= n <= MOST_RELEASES
    assert n == MOST_RELEASES or ((1.0 - p) / (p * n)) ** 0.5 <= ENOUGH
    assert (rate.event, rate.chance.probability) == ("block", p)
    assert rate.chance.low < p < rate.chance.high
    assert rate.arrivals == LIGHT.event("block").rate
    assert rate.releases == rate.arrivals / p
    found = with_release_rates(site)
    assert found.event("block").rate == rate.releases
    assert found.event("group") == LIGHT.event("group")
    assert with_release_rates(site, [rate]) == found
    assert with_release_rates(found) is found


def test_the_expected_arrivals_are_those_given(site: Site) -> None:
    """Without new barriers, on releases other than those that gave P(arrival)."""
    found = DesignProblem(with_release_rates(site)).evaluate((), range(1000))
    own = found.reach["block"]
    often = 100.0 * with_release_rates(site).rate("block")
    assert often * own.low <= LIGHT.event("block").rate <= often * own.high


def test_a_return_period_may_be_that_of_arrivals(tmp_path: Path, site: Site) -> None:
    event = msgspec.convert({"name": "block", "return_period": 5.0, "rate_of": "arrival"},
                            type(site.events[0]))  # fmt: skip
    assert (event.rate, event.rate_of) == (0.2, "arrival")
    site.save(tmp_path / "site.toml")
    assert Site.load(tmp_path / "site.toml") == site


def test_rates_that_are_not_converted_are_refused_by_name(site: Site) -> None:
    for ask in (
        lambda: site.rate("block"),
        lambda: site.draw(0),
        lambda: DesignProblem(site),
        lambda: rigdda.release(site, (), 0),
        lambda: passages(site, (), [(0, None)], [20.0]),
    ):
        with pytest.raises(BadInput) as refused:
            ask()
        assert str(refused.value) == (
            "events.block.rate_of = 'arrival': convert it to the rate of releases first: "
            "site = rigdda.envs.with_release_rates(site)"
        )
    rigdda.release(site, (), 0, "block")  # needs no rate


def test_nothing_that_arrives_gives_no_rate(site: Site) -> None:
    far = msgspec.structs.replace(
        site, surfaces={k: msgspec.structs.replace(s, rolling=1.0, restitution=0.0,
                                                   friction_deg=80.0)
                        for k, s in site.surfaces.items()}
    )  # fmt: skip
    with pytest.raises(
        BadInput, match=rf"rate_of = 'arrival': give the rate .* none of {MOST_RELEASES:,}"
    ):
        with_release_rates(far)
    with pytest.raises(BadInput, match=r"events.block.rate = 1000.*give a lower rate of arrivals"):
        with_release_rates(arriving(LIGHT, "block", rate=1000.0))


def test_the_commands_tell_both_rates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], site: Site
) -> None:
    monkeypatch.chdir(tmp_path)
    site.save("site.toml")
    (rate,) = release_rates(site)
    words = (
        rf"event 'block': rock arrives {rate.arrivals:.3g} times a year per 100 m \(given\); "
        rf"P\(arrival\) is \d+ % \(\d+ % to \d+ %, from {rate.chance.releases:,} releases without "
        rf"new barriers\); {rate.releases:.3g} releases a year per 100 m are used"
    )
    assert cli.main(["check", "site.toml", "--out", "c"]) == 0
    assert len(re.findall("note: " + words, capsys.readouterr().out)) == 1
    options = ["--budget", "200", "--verify", "40", "--ground-samples", "0", "--out", "d"]
    assert cli.main(["design", "site.toml", *options]) == 0
    assert re.search("note: " + words, capsys.readouterr().out)
    assert cli.main(["report", "d"]) == 0
    page = Path("d/report.html").read_text(encoding="utf-8")
    page = page.replace("&#39;", "'").replace("\u00a0", " ")
    assert re.search(words.replace("event", "Event", 1), page)
    record = json.loads(Path("d/run.json").read_text(encoding="utf-8"))["design"]
    used = Site.parse(record["site"], "run.json").event("block")
    assert (used.rate, used.rate_of) == (pytest.approx(rate.releases), "release")
