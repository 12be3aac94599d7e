"""The tabs without a server: what their buttons do to the project and to what is computed."""

import html
import time
import types

import pytest
from bokeh.document import Document

pn = pytest.importorskip("panel", reason="the extra page is not installed")

from panel.io.state import set_curdoc  # noqa: E402

from rigdda import BadInput, Fence, sites  # noqa: E402
from rigdda.app import site_oddities  # noqa: E402
from rigdda.app.page import ground, locking  # noqa: E402
from rigdda.app.page.falls_tab import BATCH, FallsTab  # noqa: E402
from rigdda.app.page.slope_tab import SlopeTab  # noqa: E402
from rigdda.app.page.state import Project  # noqa: E402
from rigdda.app.page.theme import LIGHT  # noqa: E402
from rigdda.app.page.workspace import Workspace  # noqa: E402


class Host:
    """The page as a tab sees it."""

    def __init__(self, workspace):
        self.workspace, self.project, self.theme = workspace, workspace.project, LIGHT
        self.said = []

    def act(self, do):
        do()
        return True

    def say(self, words):
        self.said.append(words)


@pytest.fixture
def host(tmp_path):
    (tmp_path / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    with Workspace(Project.open(tmp_path)) as workspace:
        yield Host(workspace)


def test_a_release_that_is_asked_for_before_the_tab_is_shown_is_not_lost(host):
    tab = FallsTab(host)
    tab._more()
    tab.show()
    release = tab._release
    assert release.asked == BATCH
    release.join()
    tab.tick()
    assert len(tab.section.ways.data["xs"]) == len(release.falls) == BATCH


def test_the_shares_say_whether_the_layout_stands(host):
    host.project.change_layout((Fence(17.0, 3.0, energy_class=1000),), "put a fence")
    tab = FallsTab(host)
    tab.show()
    for built, words in ((True, "with the layout"), (False, "without the layout")):
        tab._built.value = built
        tab._more()
        tab._release.join()
        tab.tick()
        assert f"Where {BATCH} blocks end, {words}" in html.unescape(tab._shares.object)


@pytest.mark.parametrize("road", [[20.0, None], [None, 28.0]])
def test_a_survey_is_not_imported_with_one_edge_of_the_road(host, road):
    file = types.SimpleNamespace(value=b"x,y\n0,10\n30,0\n", filename="survey.csv")
    with pytest.raises(BadInput, match="give both edges of the road"):
        SlopeTab(host)._import_survey("new", file, None, road)


def test_a_click_near_a_path_replays_its_block(host):
    tab = FallsTab(host)
    tab.show()
    tab._more()
    tab._release.join()
    tab.tick()
    fall = tab._release.falls[7]
    k = len(fall.x) // 2
    tab._tapped(types.SimpleNamespace(x=fall.x[k], y=fall.y[k] + 1e-4))
    assert tab._replaying.visible and tab._replayed is fall
    assert f"{fall.event}, seed {fall.seed}: {fall.end}" in html.unescape(tab._rerun.object)
    tab._tapped(types.SimpleNamespace(x=fall.x[k], y=fall.y.max() + 100.0))
    assert tab._replayed is fall


def test_a_new_layout_keeps_the_event_that_was_chosen(host):
    tab = FallsTab(host)
    tab.show()
    other = host.project.site.event_names[-1]
    assert other != host.project.site.event_names[0]
    tab._event.value = other
    host.project.set_value(("road", "end"), host.project.site.road.end + 0.5)
    tab.show()
    assert tab._event.value == other


def test_callbacks_wait_for_the_lock_of_their_document():
    document, done = Document(), []
    context = types.SimpleNamespace(session=None, server_context=None)
    document._session_context = lambda: context
    with set_curdoc(document):
        locking.locked(lambda: done.append("later"))
        assert done == []
        assert len(document.session_callbacks) == 1
        locking.holding(lambda: locking.locked(lambda: done.append("at once")))
        assert done == ["at once"]
        document.session_callbacks[0].callback()
        locking.locked(lambda: done.append("later"))
    assert done == ["at once", "later"]
    assert len(document.session_callbacks) == 1  # the first has been run
    locking.locked(lambda: done.append("no server"))
    assert done[-1] == "no server"


def test_what_is_odd_on_a_site_is_told_when_it_is_found(host):
    from rigdda.app.page.slope_tab import SlopeTab

    tab = SlopeTab(host)
    tab.show()
    site = host.project.site
    host.project.set_value(("road", "end"), site.road.start + 0.6)
    tab.show()
    tab.tick()
    latest = time.monotonic() + 60.0
    while tab._checks.found is None:
        assert time.monotonic() < latest
        time.sleep(0.01)
    tab.tick()
    odd = site_oddities.oddities(host.project.site, ())
    assert odd
    assert all(html.escape(line) in tab._findings.object for line in odd)


def test_ground_shows_observations_and_writes_what_was_fitted(tmp_path):
    from rigdda.app.page.ground_tab import GroundTab

    (tmp_path / "site.toml").write_text("# kept\n" + sites.text("verge"), encoding="utf-8")
    observed = tmp_path / "observed"
    observed.mkdir()
    runs = [9.8, 12.3, 14.1, 17.2, 20.5]
    lines = ["event,run_out_m", *(f"block,{x}" for x in runs)]
    (observed / "runs.csv").write_text("\n".join(lines), encoding="utf-8")
    (observed / "marks.csv").write_text("impact_m\n3.5\n", encoding="utf-8")
    with Workspace(Project.open(tmp_path)) as workspace:
        page = Host(workspace)
        tab = GroundTab(page)
        tab.show()
        assert tab._stops.data["x"] == runs
        assert tab._marks.data["x"] == [3.5]
        _wait(lambda: tab.match.found is not None and tab.match.found.releases == 150)
        tab.tick()
        assert len(tab._made.data["x"]) == 152
        assert f"{tab.match.found.score:.3g} metres" in tab._score.object
        tab._fitted.value = ["surfaces.soil.rolling"]
        tab._budget.value, tab._releases.value = 8, 10
        tab._begin()
        assert tab.job.state == "running"
        _wait(lambda: tab.job.state != "running")
        tab._look()
        assert tab._apply.visible
        tab._write()
        (row,) = ground.fit_rows(workspace.fit_folder)
        text = (tmp_path / "site.toml").read_text(encoding="utf-8")
        assert text.startswith("# kept")
        assert page.project.site.surfaces["soil"].rolling == pytest.approx(row.fitted, abs=1e-6)
        tab.show()
        page.project.undo()
        assert page.project.site.surfaces["soil"].rolling == 0.12


def _wait(done, seconds=120.0):
    latest = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < latest
        time.sleep(0.02)


def _entered(tab, label, value):
    """Enter a value in the first input of the tab Slope with a label."""
    widgets = [
        one.widget for row in tab._rows.values() for one in row.bound if hasattr(one, "widget")
    ]
    widget = next(one for one in widgets if one.label == label)
    assert widget.value != value
    widget.value = value


@pytest.mark.parametrize("name", ["ritchie-35", "toppling", "quick"])
def test_an_event_is_edited_whether_the_file_has_it_or_not(name, tmp_path):
    from rigdda.app.page.slope_tab import SlopeTab

    (tmp_path / "site.toml").write_text(sites.text(name), encoding="utf-8")
    with Workspace(Project.open(tmp_path)) as workspace:
        tab, before = SlopeTab(Host(workspace)), workspace.project.site
        tab.show()
        _entered(tab, "Return period on 100 metres [years]", 20.0)
        _entered(tab, "Design event", not before.events[0].design)
        _entered(tab, "The return period counts", "arrival")
        event = workspace.project.site.events[0]
        assert (event.rate, event.design) == (0.05, not before.events[0].design)
        assert event.rate_of == "arrival"
        assert (event.name, event.source, event.area) == (
            before.events[0].name, before.events[0].source, before.events[0].area
        )  # fmt: skip
        for _ in range(3):
            workspace.project.undo()
        assert workspace.project.site == before


def test_a_site_whose_rates_are_those_of_arrivals_is_shown_in_all_tabs(tmp_path):
    from rigdda.app.page.barriers_tab import BarriersTab

    text = sites.text("quick").replace('name = "block"', 'name = "block"\nrate_of = "arrival"')
    (tmp_path / "site.toml").write_text(text, encoding="utf-8")
    with Workspace(Project.open(tmp_path)) as workspace:
        page = Host(workspace)
        assert page.project.site.events[0].rate_of == "arrival"
        falls, barriers = FallsTab(page), BarriersTab(page)
        falls.show()
        falls._more()
        falls._release.join()
        falls.tick()
        falls._passed.join()
        falls.tick()
        assert "pass the collector" in falls._collector.object
        barriers.show()
        workspace.live.ask(page.project.site, page.project.layout)
        _wait(lambda: workspace.live.figures is not None and workspace.live.figures.costs)
        barriers.tick()
        assert "rock arrives" in barriers._figures.object
        assert barriers._rules.object == ""


def test_figures_of_the_collector_do_not_depend_on_what_a_rate_counts():
    import msgspec
    from light_site import LIGHT as light

    from rigdda.app.page.falls_tab import COLLECTED, Passed

    events = tuple(msgspec.structs.replace(one, rate_of="arrival") for one in light.events)
    found = []
    for site in (light, msgspec.structs.replace(light, events=events)):
        passed = Passed(site, (), "block", 40, float(site.road.start))
        passed.join()
        assert passed.fault == ""
        found.append((repr(passed.rows), repr(passed.slope)))
    assert found[0] == found[1]
    assert {row["quantity"] for row in passed.rows} == set(COLLECTED)


def test_layouts_that_meet_their_checks_are_found_whatever_a_rate_counts(tmp_path):
    from rigdda import Ditch
    from rigdda.app.page.decide_tab import DecideTab

    text = sites.text("quick").replace('name = "block"', 'name = "block"\nrate_of = "arrival"')
    (tmp_path / "site.toml").write_text(text, encoding="utf-8")
    with Workspace(Project.open(tmp_path)) as workspace:
        tab = DecideTab(Host(workspace))
        assert tab._met(())
        assert not tab._met((Ditch(500.0, 1.0, 3.0),))


def test_a_description_that_is_entered_is_that_of_the_site(host):
    from panel.widgets import TextAreaInput

    from rigdda.app.page.slope_tab import SlopeTab

    tab = SlopeTab(host)
    tab.show()
    (area,) = [one for one in tab._forms if isinstance(one, TextAreaInput)]
    assert area.value == host.project.site.description
    area.value = 'Surveyed by A. B.; "talus" below\nthe cliff.'
    assert host.project.site.description == area.value


def test_forms_follow_what_is_added_and_removed_and_keep_the_other_rows(host):
    from rigdda.app.page.slope_tab import SlopeTab

    tab = SlopeTab(host)
    tab.show()
    before, events = dict(tab._rows), len(host.project.site.events)
    tab._add_event()
    tab.show()
    (new,) = set(tab._rows) - set(before)
    assert new[:2] == ("event", events)
    assert all(tab._rows[key] is row for key, row in before.items())
    tab._remove_event(events)
    tab.show()
    assert tab._rows == before
    names = [row.bound[0].widget.value for key, row in tab._rows.items() if key[0] == "event"]
    assert names == list(host.project.site.event_names)
    with pytest.raises(BadInput, match="new stretch"):
        tab._add_stretch("meadow", None, 12.0)


def test_only_results_that_are_complete_go_into_a_report(host):
    from rigdda.agents.run_record import RunRecord, write_records
    from rigdda.app.page.report_tab import ReportTab

    for name, ended in (("fit-1", ""), ("study", "2026-11-30T00:47:12Z")):
        record = RunRecord.begin(name[:5].strip("-1"), [], {}, None)
        record.ended = ended
        (host.project.folder / name).mkdir()
        write_records(host.project.folder / name, {record.command: record})
    tab = ReportTab(host)
    tab.show()
    assert tab._results.options == {"study: figures of the layout, 2026-11-30 00:47 UTC": "study"}
    assert tab._results.value == ["study"]


def test_results_of_a_layout_are_computed_in_a_relative_folder(tmp_path, monkeypatch):
    from rigdda.app.page.report_tab import ReportTab

    monkeypatch.chdir(tmp_path)
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    with Workspace(Project.open("project")) as workspace:
        workspace.study_file.write_text("", encoding="utf-8")
        tab, begun = ReportTab(Host(workspace)), []
        monkeypatch.setattr(tab.study, "start", begun.append)
        tab._compute()
    assert begun[0][:2] == ["study", str(workspace.study_file)]


def test_new_barriers_have_round_sizes_and_chainages(host):
    from rigdda.app.page import placing

    for kind in ("fence", "ditch", "embankment"):
        barrier = placing.new_barrier(host.project.site, (), kind)
        for value in (barrier.x, *(getattr(barrier, one.field) for one in barrier.lengths)):
            assert value == pytest.approx(round(value, 1))
