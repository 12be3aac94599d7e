"""Live figures are those of `rigdda study`; releases are computed in the background."""

import csv
import time
from types import SimpleNamespace

import msgspec
import pytest
import tomli_w
from light_site import LIGHT

from rigdda import BadInput, Fence, Site, save_layout
from rigdda.app.cli import main
from rigdda.app.page import rates
from rigdda.app.page.barriers_tab import _rules, figures_html
from rigdda.app.page.falls import ENDS, Release, shares
from rigdda.app.page.figures import study_table
from rigdda.app.page.known_layout import CURRENT
from rigdda.app.page.live import Live
from rigdda.envs import outcome_cache, site_store, with_release_rates

LAYOUT = (Fence(30.0, 4.0, energy_class=1000),)


def _of_arrivals(site: Site, rate: float | None = None) -> Site:
    """Return a site in which the rate of the first event is that of arrivals."""
    first = site.events[0]
    given = msgspec.structs.replace(
        first, rate_of="arrival", rate=first.rate if rate is None else rate
    )
    return msgspec.structs.replace(site, events=(given, *site.events[1:]))


ARRIVALS = _of_arrivals(LIGHT)


def _wait(live: Live, done) -> None:
    latest = time.monotonic() + 200.0
    while live.figures is None or not done(live.figures):
        assert time.monotonic() < latest, live.figures
        time.sleep(0.02)


@pytest.fixture
def live():
    made = Live(most=50)
    yield made
    made.close()


@pytest.mark.parametrize("site", [LIGHT, ARRIVALS], ids=["releases", "arrivals"])
def test_figures_are_those_of_the_command_to_the_digit(site, live, tmp_path, capsys):
    live.ask(site, LAYOUT)
    _wait(live, lambda found: found.releases == 50 and not found.doing)
    found = live.figures
    assert found.checks is not None
    site.save(tmp_path / "site.toml")
    save_layout(LAYOUT, tmp_path / "layout.toml")
    table = study_table("site.toml", LAYOUT, "layout.toml", 50)
    (tmp_path / "study.toml").write_text(tomli_w.dumps(table))
    out = tmp_path / "out"
    assert main(["study", str(tmp_path / "study.toml"), "--seed", "0", "--out", str(out)]) == 0
    for name, own in (("layouts", [found.costs]), ("events", found.events)):
        with (out / f"{name}.csv").open(newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["layout"] == CURRENT]
        assert rows == [{k: "" if v != v else str(v) for k, v in row.items()} for row in own]


def test_rates_of_arrivals_are_converted_and_told_in_the_background(live):
    live.ask(ARRIVALS, LAYOUT)
    _wait(live, lambda found: found.releases == 50 and not found.doing)
    found = live.figures
    assert (found.broken, found.fault, found.error) == ((), "", "")
    (note,) = found.notes
    used = with_release_rates(ARRIVALS).events[0].rate
    assert used > ARRIVALS.events[0].rate
    assert f"{used:.3g} releases a year per 100 m are used" in note
    assert "P(arrival)" in figures_html(found, "red", "grey")
    assert live.known(ARRIVALS, LAYOUT) == found


def test_releases_for_a_rate_are_simulated_in_portions_and_only_once(tmp_path, monkeypatch):
    slower = msgspec.structs.replace(LIGHT.motion, duration=23.5)  # no other test simulates it
    site = _of_arrivals(msgspec.structs.replace(LIGHT, motion=slower))
    monkeypatch.setattr(site_store, "path_of", lambda name, key: tmp_path / f"{name}-{key.hex()}")
    sizes, simulate = [], outcome_cache.outcomes

    def counted(jobs):
        sizes.append(len(jobs))
        return simulate(jobs)

    monkeypatch.setattr(outcome_cache, "outcomes", counted)
    told = list(rates.simulate(site))
    assert len(sizes) == len(told) > 4
    assert sizes[0] == 4
    assert told[-1] == (
        f"computing the rate of block from {sum(sizes):,} releases without new barriers"
    )
    monkeypatch.setattr(outcome_cache, "outcomes", lambda jobs: pytest.fail("it simulates"))
    found = rates.released(site)
    assert found.site == with_release_rates(site)
    assert f"from {sum(sizes):,} releases" in found.notes[0]
    assert list(rates.simulate(LIGHT)) == []
    assert rates.released(LIGHT) == (LIGHT, ())


def test_a_rate_that_cannot_be_converted_does_not_blame_the_layout(live):
    site = _of_arrivals(LIGHT, 999.0)
    with pytest.raises(BadInput, match="lower rate of arrivals"):
        with_release_rates(site)
    live.ask(site, LAYOUT)
    _wait(live, lambda found: bool(found.error))
    found = live.figures
    assert (found.broken, found.fault, found.doing) == ((), "", "")
    assert "lower rate of arrivals" in found.error
    told = _rules(found, "red")
    assert "in the tab Slope" in told
    assert "figures cannot be computed" in told
    assert "may not be built" not in told and "rigdda.envs" not in told
    live.ask(LIGHT, LAYOUT)
    _wait(live, lambda found: found.costs is not None)
    assert _rules(live.figures, "red") == ""


def test_an_impossible_layout_is_told_before_rates_are_converted(live, monkeypatch):
    monkeypatch.setattr(rates, "simulate", lambda site: pytest.fail("it converts rates"))
    live.ask(ARRIVALS, (Fence(500.0, 3.0, energy_class=1000),))
    _wait(live, lambda found: bool(found.fault or found.error))
    assert live.figures.broken and live.figures.error == ""
    assert "may not be built" in _rules(live.figures, "red")


def test_another_price_needs_no_new_release(live, monkeypatch):
    live.ask(LIGHT, LAYOUT)
    _wait(live, lambda found: found.releases == 50 and not found.doing)
    before = live.figures
    monkeypatch.setattr("rigdda.release_many", lambda jobs: pytest.fail("it simulates"))
    dear = msgspec.structs.replace(LIGHT.consequences, closure=2.0 * LIGHT.consequences.closure)
    live.ask(msgspec.structs.replace(LIGHT, consequences=dear), LAYOUT)
    _wait(live, lambda found: found.costs is not None and found.costs != before.costs)
    assert live.figures.costs["harm"] > before.costs["harm"]
    assert live.figures.costs["cost"] == before.costs["cost"]


def test_a_layout_that_cannot_stand_tells_why(live):
    live.ask(LIGHT, (Fence(500.0, 3.0, energy_class=1000),))
    _wait(live, lambda found: bool(found.fault))
    assert "500" in live.figures.fault
    assert live.figures.broken


def test_releases_appear_as_they_are_computed_and_can_be_stopped():
    release = Release(LIGHT, (), "block")
    release.more(20)
    release.join()
    assert release.done == len(release.falls) == 20
    assert {fall.end for fall in release.falls} <= set(ENDS.values())
    assert sum(share.probability for share in shares(release.falls).values()) == pytest.approx(1)
    fall = release.falls[0]
    start = fall.outline(0.0)
    assert start == pytest.approx(fall.found.vertices[0])
    release.more(100_000)
    release.stop()
    release.join()
    assert release.done < 100_020
    assert release.asked == release.done


def test_an_error_of_a_release_is_told():
    release = Release(LIGHT, (Fence(500.0, 3.0, energy_class=1000),), "block")
    release.more(5)
    release.join()
    assert "500" in release.fault


def test_alternatives_are_computed_without_being_opened(live):
    other, impossible = (), (Fence(500.0, 3.0, energy_class=1000),)
    live.ask(LIGHT, LAYOUT, (other, impossible))
    _wait(live, lambda found: not found.doing and live.known(LIGHT, impossible) is not None)
    assert live.known(LIGHT, other).releases == 50
    for name in ("objective", "harm", "repair", "cost"):
        assert live.known(LIGHT, other).costs[name] == live.figures.bare[name]
    assert "500" in live.known(LIGHT, impossible).fault
    assert live.figures.layout == LAYOUT


def test_more_releases_after_a_stop_are_computed():
    release = Release(LIGHT, (), "block")
    release.more(100_000)
    release.stop()
    stopped = release.done
    release.more(30)
    release.join()
    assert not release.running and release.fault == ""
    assert stopped + 30 <= release.done < 1000
    assert release.asked == release.done == len(release.falls)


def test_blocks_of_a_release_are_not_independent():
    alike = [SimpleNamespace(end=end, seed=k) for k, end in enumerate(ENDS.values())]
    many = [one for one in alike for _ in range(50)]
    wide, narrow = shares(alike), shares(many)
    for end in ENDS.values():
        assert narrow[end].probability == pytest.approx(wide[end].probability)
        assert narrow[end].releases == 50 * wide[end].releases
        assert narrow[end].high - narrow[end].low == pytest.approx(
            wide[end].high - wide[end].low, rel=0.1
        )
