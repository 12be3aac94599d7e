"""The tabs without a server: what their buttons do to the project and to what is computed."""

import html
import time
import types

import pytest
from bokeh.document import Document

pn = pytest.importorskip("panel", reason="the extra page is not installed")

from panel.io.state import set_curdoc  # noqa: E402

from rigdda import sites  # noqa: E402
from rigdda.app import site_check  # noqa: E402
from rigdda.app.page import locking  # noqa: E402
from rigdda.app.page.falls_tab import BATCH, FallsTab  # noqa: E402
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
    latest = time.monotonic() + 60.0
    while tab._checks.found is None:
        assert time.monotonic() < latest
        time.sleep(0.01)
    tab.tick()
    odd = site_check.oddities(host.project.site, ())
    assert odd
    assert all(html.escape(line) in tab._findings.object for line in odd)
