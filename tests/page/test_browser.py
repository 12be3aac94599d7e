"""The page in a real browser: from a survey to a dragged fence, and back by the command line."""

import csv
import os
import shlex
import shutil
import time
import tomllib

import pytest
from light_site import LIGHT

from experiments.page.driver import HANDLE, PLACE, open_tab
from rigdda import Fence, Site, load_layout, save_layout
from rigdda.app.cli import main

SURVEY = """chainage,elevation
0,45
6,44.5
9,35
16,20.5
18.5,19.4
20.5,26.8
23,10
25.5,9
29.8,0
34.8,-0.5
44.8,-0.5
62,-0.8
85,-2
"""
"""A profile whose sixth point is a typing error."""


TABS = ("Slope", "Falls", "Ground", "Barriers", "Decide", "Report")


def _drag(tab, title, words, change, done, still=0.0):
    """Drag a handle until something is done, after it was held still for a while [s]."""
    for _ in range(5):
        x, y = tab.wait_for_function(HANDLE, arg=words, timeout=30_000).json_value()
        a = tab.wait_for_function(PLACE, arg=[title, x, y]).json_value()
        b = tab.evaluate(PLACE, [title, x + change[0], y + change[1]])
        tab.mouse.move(*a)
        tab.wait_for_timeout(100)
        tab.mouse.down()
        tab.wait_for_timeout(1e3 * still)
        tab.mouse.move((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, steps=4)
        tab.mouse.move(*b, steps=4)
        tab.mouse.up()
        for _ in range(60):
            if done():
                return
            tab.wait_for_timeout(50)
    raise AssertionError(f"{words} was not dragged")


def _wait(done, seconds=90.0):
    latest = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < latest
        time.sleep(0.05)


def _figures(tab):
    """Return the figures of the layout with all digits, by name."""
    found = tab.locator("data.exact").evaluate_all(
        "all => all.map(one => [one.title, one.getAttribute('value')])"
    )
    return dict(found)


def _layout(folder):
    file = folder / "layout.toml"
    return load_layout(file) if file.is_file() else ()


def _settled_figures(tab, project):
    """Return the figures that the page shows, once they are those of its study of the layout."""
    tab.wait_for_timeout(1000)  # those of the layout before have disappeared
    for _ in range(120):
        text, figures = (project / "study.toml").read_text(), _figures(tab)
        tab.wait_for_timeout(500)
        table = tomllib.loads(text)
        unchanged = (project / "study.toml").read_text() == text and _figures(tab) == figures
        if unchanged and figures.get("block-releases") == str(table["releases"]):
            return figures
    raise AssertionError("the figures never settle")


@pytest.fixture
def project(tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    return folder


@pytest.mark.slow
def test_a_fence_is_dragged_and_its_figures_are_those_of_the_command(serve, tab, project, capsys):
    LIGHT.save(project / "site.toml")
    tab.goto(serve(project).address)
    open_tab(tab, "Barriers")
    tab.get_by_role("button", name="Add fence").click()
    _wait(lambda: len(_layout(project)) == 1)
    fence = _layout(project)[0]
    title = "Section with barriers"
    _drag(tab, title, "place of the fence 1", (-3.6, 5.0), lambda: _layout(project)[0] != fence)
    moved = _layout(project)[0]
    assert moved.x == pytest.approx(fence.x - 3.6, abs=0.3)
    _drag(tab, title, "height of the fence 1", (0.0, 4.0), lambda: _layout(project)[0] != moved)
    assert _layout(project)[0].height > moved.height
    tab.locator("data.exact").first.wait_for(state="attached")
    command = tab.locator("code.command").inner_text()
    shown = _settled_figures(tab, project)
    shutil.copyfile(project / "study.toml", project / "kept.toml")
    words = shlex.split(command.replace("study.toml", "kept.toml"))
    assert main(words[1:]) == 0
    with (project / "study" / "layouts.csv").open(newline="") as file:
        row = next(r for r in csv.DictReader(file) if r["layout"] == "layout")
    for name, value in row.items():
        if name != "layout":
            assert shown[f"layout-{name}"] == value, name
    tab.get_by_role("button", name="Undo").click()
    _wait(lambda: _layout(project)[0].height == moved.height)


def test_a_forbidden_layout_tells_why_and_markup_is_text(serve, tab, project):
    mark = "<img src=x onerror=document.title='bad'>"
    text = Site.load("quick")
    text.save(project / "site.toml")
    data = (project / "site.toml").read_text().replace('"quick"', f'"{mark}"', 1)
    data = data.replace('name = "block"', f'name = "{mark}"').replace(
        "block = 0.2", f'"{mark}" = 0.2'
    )
    (project / "site.toml").write_text(data)
    assert Site.load(project / "site.toml").name == mark
    save_layout((Fence(31.0, 3.0, energy_class=1000),), project / "layout.toml")
    (project / "layouts").mkdir()
    save_layout((), project / "layouts" / "<b>x<b>.toml")
    tab.goto(serve(project).address)
    tab.get_by_role("heading", name=mark).wait_for()
    for name in TABS:
        open_tab(tab, name)
        tab.wait_for_timeout(400)
    open_tab(tab, "Barriers")
    tab.get_by_text("the road begins at 34.8").wait_for()
    assert tab.locator("img[src=x]").count() == 0
    assert tab.title() != "bad"


@pytest.mark.slow
def test_from_a_survey_to_a_search_that_survives_its_server(serve, chromium, tab, project):
    survey = project.parent / "section.csv"
    survey.write_text(SURVEY)
    server = serve(project)
    tab.goto(server.address)
    tab.get_by_text("import a survey").first.wait_for()
    tab.locator("input[type=file]").set_input_files(survey)
    tab.wait_for_timeout(500)
    tab.get_by_role("button", name="Make the site").click()
    tab.get_by_role("button", name="Put it on the line").click()
    _wait(lambda: Site.load(project / "site.toml").slope.points[5][1] == pytest.approx(15.222))
    site = Site.load(project / "site.toml")
    end = site.sources[0].band[1]

    def band():
        return Site.load(project / "site.toml").sources[0].band

    _drag(tab, "Section of the slope", f"lower end of {site.sources[0].name}", (-2.0, 2.0),
          lambda: band()[1] != end)  # fmt: skip
    assert band()[1] == pytest.approx(end - 2.0, abs=0.5)
    open_tab(tab, "Falls")
    tab.get_by_text("Nothing is released yet.").wait_for()
    tab.get_by_role("button", name="Release 200").click()
    tab.get_by_text("200 of 200 releases").wait_for()
    collector = tab.get_by_label("Collector at chainage")
    before = float(collector.input_value())
    _drag(tab, "Releases; a click on a path replays it", "collector", (-5.0, 0.0),
          lambda: float(collector.input_value()) != before, still=0.6)  # fmt: skip
    assert float(collector.input_value()) == pytest.approx(before - 5.0, abs=0.6)
    other = chromium.new_page(viewport={"width": 1280, "height": 720})
    other.goto(server.address)
    open_tab(other, "Barriers")
    open_tab(tab, "Barriers")
    tab.get_by_role("button", name="Add fence").click()
    other.get_by_text("1. fence").wait_for(timeout=20_000)  # the tabs show the same project
    other.close()
    open_tab(tab, "Decide")
    tab.get_by_role("button", name="Start the search").click()
    _wait((project / "search.job.json").exists)
    _wait(lambda: any(project.glob("design-*/evaluations.csv")), 240.0)
    before = load_layout(project / "layout.toml"), Site.load(project / "site.toml")
    server.kill()
    server.start()
    tab.goto(server.address)
    open_tab(tab, "Decide")
    tab.get_by_text("The search is interrupted").wait_for()
    assert (load_layout(project / "layout.toml"), Site.load(project / "site.toml")) == before
    tab.get_by_role("button", name="Resume").click()
    tab.get_by_text("The search is running").wait_for()
    children = _children(server.process.pid)
    assert len(children) == 1
    tab.get_by_role("button", name="Cancel").click()
    tab.get_by_text("The search is cancelled").wait_for()
    assert _children(server.process.pid) == []


def test_the_first_click_counts_and_the_console_is_quiet(serve, tab, project):
    said = []
    tab.on("console", lambda m: said.append(m.text) if m.type in ("warning", "error") else None)
    tab.on("response", lambda r: said.append(r.url) if r.status >= 400 else None)
    LIGHT.save(project / "site.toml")
    tab.goto(serve(project).address)
    open_tab(tab, "Falls")
    tab.get_by_role("button", name="Release 200").click()
    tab.get_by_text("200 of 200 releases").wait_for()
    for name in TABS:
        open_tab(tab, name)
        tab.wait_for_timeout(500)
    tab.get_by_text("What goes into the report").wait_for()
    assert said == []


def test_observations_are_added_and_the_match_follows_a_slider(serve, tab, project):
    LIGHT.save(project / "site.toml")
    runs = project.parent / "runs.csv"
    runs.write_text("event,run_out_m\n" + "".join(f"block,{x}\n" for x in (33.0, 38.0, 41.5)))
    tab.goto(serve(project).address)
    open_tab(tab, "Ground")
    tab.get_by_text("No observations yet.").wait_for()
    tab.locator("input[type=file]:visible").set_input_files(runs)
    tab.wait_for_timeout(500)
    tab.get_by_role("button", name="Add the observations").click()
    tab.get_by_text("of 150 releases of each event").wait_for()
    assert (project / "observed" / "runs.csv").read_text() == runs.read_text()
    rolling = Site.load(project / "site.toml").surfaces["rock"].rolling
    inputs = tab.locator("input.bk-input:visible:not([type=file])").all()
    number = next(one for one in inputs if one.input_value() == str(rolling))
    number.fill("0.11")
    number.press("Enter")
    _wait(lambda: Site.load(project / "site.toml").surfaces["rock"].rolling != rolling)
    tab.get_by_role("button", name="Undo").click()
    _wait(lambda: Site.load(project / "site.toml").surfaces["rock"].rolling == rolling)


def _children(pid):
    """Return the processes that a process has started and that still run."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                with open(f"/proc/{name}/stat") as file:
                    state, parent = file.read().rpartition(")")[2].split()[:2]
            except OSError:
                continue
            if int(parent) == pid and state != "Z":
                found.append(int(name))
    return found
