"""The report of results folders: its numbers, its form, and what it says of bad folders."""

from __future__ import annotations

import csv
import dataclasses
import html
import json
import math
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import pytest
from processes import run

import rigdda
from rigdda import MECHANICS, BadInput, Site
from rigdda.agents.run_record import RunRecord, read
from rigdda.app import browser, cli, report_server
from rigdda.app.reports import findings, html_report, site_description
from rigdda.app.reports.html_blocks import inline
from rigdda.app.reports.report_contents import EXHIBITS

DESIGN = [
    "design", "chute.toml", "--budget", "60", "--verify", "40", "--target", "0.05",
    "--ground-samples", "2",
]  # fmt: skip
SIMULATE = ["simulate", "chute.toml", "--releases", "60", "--station", "28", "--station", "34.8"]


class Made(NamedTuple):
    """Results folders of a design and a simulation, what they printed, and their report."""

    folder: Path
    printed: str
    page: str


@pytest.fixture(scope="module")
def made(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Made:
    folder = tmp_path_factory.mktemp("report")
    site.save(folder / "chute.toml")
    printed = ""
    for arguments in (
        [*DESIGN, "--out", "decision"],
        [*SIMULATE, "--out", "before"],
        ["report", "decision", "before", "--out", "out"],
    ):
        printed += run(*arguments, folder=folder)
    return Made(folder, printed, (folder / "out/report.html").read_text(encoding="utf-8"))


class Page(HTMLParser):
    """Tables, texts and tags of a page."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.tables: dict[str, list[dict[str, str]]] = {}
        self.heads: list[str] = []
        self.rows: dict[str, list[int]] = {}
        self._source = self._columns = self._tag = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        self.tags.append((tag, own))
        self._tag = tag
        if tag == "table":
            self._source = own.get("data-source") or ""
        elif tag == "tr" and self._source and "data-row" in own:
            self.tables.setdefault(self._source, []).append({})
            self.rows.setdefault(self._source, []).append(int(own["data-row"] or ""))
        elif tag == "td":
            self._columns = own.get("data-columns") or ""

    def handle_endtag(self, tag: str) -> None:
        self._tag = ""
        self._source = "" if tag == "table" else self._source

    def handle_data(self, data: str) -> None:
        if self._tag == "td" and self._source:
            self.tables[self._source][-1][self._columns] = data.replace("\u00a0", " ")
        if self._tag == "h2":
            self.heads.append(data)


NUMBER = re.compile(r"[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")


def same(text: str, value: float, name: str) -> bool:
    """Return whether a printed number is a value to its last figure; per cent to two figures.

    Ends of intervals and bounds, which the `name` of the column tells, are rounded outward.
    """
    shown, percent = float(text.rstrip("%").replace(",", "")), text.endswith("%")
    exact = 100.0 * value if percent else value
    if exact == 0.0:
        return shown == 0.0
    least = 10.0 ** (math.floor(math.log10(abs(exact))) - (1 if percent else 2))
    last, more = min(max(least, 1e-12), 1.0) * (1.0 + 1e-9), shown - exact
    if name.endswith("_low"):
        return -last < more <= 1e-9 * last
    if name.endswith(("_high", "_bound")):
        return -1e-9 * last <= more < last
    return abs(more) <= 0.5 * last


def test_every_number_of_a_table_is_that_of_its_file(made: Made) -> None:
    page, compared = Page(made.page), Counter[str]()
    assert set(page.tables) >= {
        "decision/layouts.csv", "decision/chances.csv", "decision/frontier.csv",
        "before/stations.csv", "decision/checks.csv", "decision/design_sheet.csv",
    }  # fmt: skip
    for source, shown in page.tables.items():
        with (made.folder / source).open(encoding="utf-8", newline="") as file:
            known = list(csv.DictReader(file))
        for number, cells in zip(page.rows[source], shown, strict=True):
            for columns, text in cells.items():
                names = [columns] if columns in known[number] else columns.split()
                values = [known[number][name] for name in names]
                if not all(re.fullmatch(r"([-+\d.e]*\d)?", value) for value in values):
                    continue
                pairs = zip(values, names, strict=True)
                wanted = [(float(value), name) for value, name in pairs if value]
                found = re.findall(rf"{NUMBER.pattern}%?", text.replace(" %", "%"))
                if len(found) == 1 < len(wanted):  # an interval without length
                    wanted = [pair for pair in wanted if pair[0] == wanted[0][0]][:1]
                assert len(found) == len(wanted), (source, columns, text)
                pairs = zip(found, wanted, strict=True)
                assert all(same(one, *pair) for one, pair in pairs), (source, columns, text, wanted)
                compared[source] += len(found)
    assert min(compared.values()) > 5 and compared["before/stations.csv"] > 200


def test_costs_are_written_as_the_command_prints_them(made: Made) -> None:
    rows = Page(made.page).tables["decision/layouts.csv"]
    assert len(rows) == 5
    for row in rows:
        z = row["objective objective_low objective_high"]
        assert re.search(
            rf"{re.escape(row['layout barriers'].partition(':')[0])} +{re.escape(z)} ", made.printed
        ), row


def test_stations_are_written_as_the_command_prints_them(made: Made) -> None:
    rows = Page(made.page).tables["before/stations.csv"]
    energies = [row for row in rows if row["quantity unit"] == "energy [kJ]"]
    whole = [row for row in energies if row["event"] == "all events"]
    assert len(whole) == 2 and len(energies) == 6
    for row in whole:
        cells = (row["q50"], row["q95 q95_low q95_high"], row["q99 q99_low q99_high"])
        assert re.search(r" +".join(map(re.escape, cells)), made.printed), row


def test_the_answer_comes_first(made: Made) -> None:
    text = re.sub(r"<[^>]+>", " ", made.page.partition("<h2>2.")[0]).replace("\u00a0", " ")
    first = next(line.strip() for line in text.partition("Summary")[2].splitlines() if line.strip())
    assert findings.is_headline(first) and html.unescape(first) in made.printed.splitlines()
    assert re.search(r"(ditch|fence|embankment|gravity wall|mesh) .* at x = \d", text)
    assert "the target that a block of a design event reaches the road" in text
    with (made.folder / "decision/layouts.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    chosen = next(row for row in rows if row["chosen"] == "True")
    assert f"{float(chosen['cost']):,.0f} EUR" in text
    for line in read(made.folder / "decision")["design"].findings:
        assert line[1:] in text.replace("&#39;", "'").replace("&lt;", "<")
    assert "defaults of the program" in text


def test_the_page_needs_nothing_else(made: Made) -> None:
    page = Page(made.page)
    assert not [tag for tag, _ in page.tags if tag in ("script", "link", "iframe", "object")]
    for _, own in page.tags:
        for name in ("src", "href", "xlink:href"):
            assert (own.get(name) or "#").startswith(("#", "data:")), own
    style = made.page.partition("<style>")[2].partition("</style>")[0]
    assert "url(" not in style and "@import" not in style
    ids = [own["id"] for _, own in page.tags if own.get("id")]
    assert [name for name, count in Counter(ids).items() if count > 1] == []
    used = re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', made.page)
    assert len(used) > 100 and {first or second for first, second in used} <= set(ids)


def test_sections_come_only_with_results(made: Made) -> None:
    heads = [head.partition(". ")[2] for head in Page(made.page).heads]
    assert heads == [
        "Summary", "Site", "Assumptions and their sources", "What comes down", "Layouts compared",
        "Checks", "How sure the answer is", "What other targets cost", "Limits of the method",
        "How to repeat the results", "Appendix",
    ]  # fmt: skip
    assert cli.main(["report", str(made.folder / "before")]) == 0
    text = (made.folder / "before/report.html").read_text(encoding="utf-8")
    assert "Layouts compared" not in text and "What comes down" in text


def test_each_picture_of_the_folders_is_a_vector(made: Made) -> None:
    pictures = [own for tag, own in Page(made.page).tags if tag == "svg"]
    names = [own["aria-label"] for own in pictures]
    assert names == [
        "Section of the site", "Trajectories and envelopes", "Histograms at x = 28 m",
        "Histograms at x = 34.8 m", "Along the slope", "Run-out",
        "The slope without and with the layout", "Cost and risk",
        "What the rule demands along the slope", "The layouts on other grounds",
        "Cost and probability",
    ]  # fmt: skip
    assert "<img" not in made.page


def test_a_png_stands_in_for_a_vector_picture(made: Made, tmp_path: Path) -> None:
    shutil.copytree(made.folder / "before", tmp_path / "b")
    (tmp_path / "b/run_out.svg").unlink()
    assert cli.main(["report", str(tmp_path / "b")]) == 0
    text = (tmp_path / "b/report.html").read_text(encoding="utf-8")
    assert text.count('<img alt="Run-out" src="data:image/png;base64,') == 1


def test_commands_seeds_and_versions_are_there(made: Made) -> None:
    text = made.page
    assert f"rigdda {' '.join(DESIGN)} --out decision" in text
    assert f"rigdda {' '.join(SIMULATE)} --out before" in text
    assert MECHANICS in text and f">{rigdda.__version__}<" in text
    assert "damping_when = &#34;contact&#34;" in text  # a default in the site as used


def test_unknown_tables_are_in_the_appendix(made: Made, tmp_path: Path) -> None:
    shutil.copytree(made.folder / "before", tmp_path / "b")
    (tmp_path / "b/new_check.csv").write_text(
        "what,x_m,value,value_low,value_high\na,134.25,1.5,1,2\n"
    )
    long = "\n".join(["n", *map(str, range(500))])
    (tmp_path / "b/long.csv").write_text(long + "\n")
    assert cli.main(["report", str(tmp_path / "b")]) == 0
    text = (tmp_path / "b/report.html").read_text(encoding="utf-8")
    page = Page(text)
    (row,) = page.tables["b/new_check.csv"]
    assert row == {"what": "a", "x_m": "134.25", "value value_low value_high": "1.5 (1 to 2)"}
    assert (
        "b/long.csv" not in page.tables and "columns: n" in (tmp_path / "b/report.html").read_text()
    )


def test_each_exhibit_belongs_to_a_section() -> None:
    names = {section.name for section in html_report.SECTIONS}
    assert {exhibit.section for exhibit in EXHIBITS} <= names


def test_differences_of_sites_name_each_value() -> None:
    site = Site.load("quick")
    prices = msgspec.structs.replace(site.prices, interest=0.05)
    assert site_description.site_differences(site, site) == []
    assert site_description.site_differences(
        site, msgspec.structs.replace(site, prices=prices)
    ) == ["prices.interest = 0.05 instead of 0.03"]


# Records of results folders


def test_a_record_says_what_made_a_folder(made: Made) -> None:
    record = read(made.folder / "decision")["design"]
    assert record.arguments == [*DESIGN, "--out", "decision"]
    assert record.options["seed"] == 0 and record.options["designer"] == "race"
    assert record.started <= record.ended and record.versions.mechanics == MECHANICS
    assert Site.parse(record.site, "record") == Site.load(made.folder / "chute.toml")
    assert {"layouts.csv", "layout.toml", "section.png", "episode.rrd"} <= set(record.files)
    assert record.findings and all(line in made.printed for line in record.findings)
    data = json.loads((made.folder / "decision/run.json").read_text())
    assert list(data) == ["design"] and data["design"]["options"]["target"] == 0.05


def test_a_folder_keeps_the_records_of_several_commands(tmp_path: Path) -> None:
    for command in ("simulate", "check"):
        RunRecord.begin(command, [command, "quick"], {"out": tmp_path}, None).write(tmp_path)
    known = read(tmp_path)
    assert list(known) == ["simulate", "check"]
    assert known["check"].options == {"out": str(tmp_path)} and known["check"].ended == ""


# Bad input


@pytest.fixture
def before(made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the folder of the simulation in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(made.folder / "before", "b", ignore=shutil.ignore_patterns("report.*"))
    return Path("b")


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one line with which a command refuses its arguments."""
    assert cli.main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("rigdda: ") and err.count("\n") == 1
    return err


def test_a_path_that_is_no_folder(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("nowhere", "b/stations.csv"):
        assert f"RESULTS = '{name}': name an existing folder" in refused(["report", name], capsys)


def test_a_folder_without_a_record(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (before / "run.json").unlink()
    assert "RESULTS = 'b': it has no run.json" in refused(["report", "b"], capsys)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"simulate": {"command": 3}}', "\udcff"])
def test_a_damaged_record(text: str, before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (before / "run.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert "RESULTS = 'b/run.json': " in refused(["report", "b"], capsys)


def test_a_run_that_was_interrupted(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = json.loads((before / "run.json").read_text())
    data["simulate"]["ended"] = ""
    (before / "run.json").write_text(json.dumps(data))
    told = refused(["report", "b"], capsys)
    assert "RESULTS = 'b': its run was interrupted" in told and "rigdda simulate chute.toml" in told


def test_a_missing_file(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (before / "stations.csv").unlink()
    told = refused(["report", "b"], capsys)
    assert "RESULTS = 'b/stations.csv': this file is missing" in told


@pytest.mark.parametrize(
    "change, mend",
    [
        (lambda text: text.replace("q95_low", "low"), "it lacks the column 'q95_low'"),
        (lambda text: text.replace(",quantity,", ",what,"), "it lacks the column 'quantity'"),
        (lambda text: re.sub(r"(kJ,\d+,)", r"\1x", text, count=1), "is not a number"),
        (lambda text: text + "1,2\n", "which has 2 cells, not"),
        (lambda text: "", "it lacks the column"),
    ],
)
def test_a_damaged_table(
    change: Any, mend: str, before: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = before / "stations.csv"
    file.write_text(change(file.read_text()))
    told = refused(["report", "b"], capsys)
    assert "RESULTS = 'b/stations.csv': " in told and mend in told


def test_a_damaged_picture(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (before / "run_out.svg").write_text("gone")
    assert "RESULTS = 'b/run_out.svg': this is not a picture" in refused(["report", "b"], capsys)


def test_a_folder_that_is_named_twice(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "RESULTS = 'b': name each folder once" in refused(["report", "b", "b/."], capsys)


def test_a_folder_that_cannot_be_written(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (before / "report.html").mkdir()
    assert "--out = 'b/report.html': " in refused(["report", "b"], capsys)
    told = refused(["report", "b", "--out", "b/stations.csv"], capsys)
    assert "b/stations.csv" in told and not list(Path().glob("report*"))


def test_a_replay_that_is_not_there(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "RESULTS = 'b': none has a replay" in refused(["report", "b", "--serve"], capsys)


def test_a_browser_that_is_not_there(
    before: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(before))
    monkeypatch.setattr(browser, "APPLICATIONS", ())
    told = refused(["report", "b", "--pdf"], capsys)
    assert "--pdf = True: no browser was found" in told and not (before / "report.html").exists()


def test_a_browser_that_fails(before: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(rigdda.Error, match=r"could not print .*: code 1"):
        browser.print_pdf(shutil.which("false") or "false", before / "report.html")
    with pytest.raises(rigdda.Error, match="could not print"):
        browser.print_pdf(str(before / "nothing"), before / "report.html")
    assert not (before / "report.pdf").exists()


SNAP = """#!/bin/sh
# /snap/bin/chromium: it sees the home directory, and instead of {hidden} a folder of its own
for word in "$@"; do
  case "$word" in
    --print-to-pdf=*) target=${{word#--print-to-pdf=}} ;;
    file://*) page=${{word#file://}} ;;
  esac
done
case "$target" in
  {hidden}/*) exit {code} ;;
esac
cp "$page" "$target"
"""


@pytest.mark.parametrize("code", [0, 1])
def test_a_browser_with_a_temporary_folder_of_its_own(
    code: int, before: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, snap = before / "report.html", tmp_path / "chromium"
    page.write_text("<p>the page</p>")
    hidden, home = tmp_path / "tmp", tmp_path / "home"
    hidden.mkdir()
    home.mkdir()
    snap.write_text(SNAP.format(hidden=hidden, code=code))
    snap.chmod(0o755)
    monkeypatch.setattr(tempfile, "tempdir", str(hidden))
    with pytest.raises(rigdda.Error) as failed:
        browser.print_pdf(str(snap), page)
    words = str(failed.value)
    assert "set TMPDIR to a folder in your home directory" in words and "Debian package" in words
    assert str(hidden) in words and "\n" not in words
    assert not (before / "report.pdf").exists()
    monkeypatch.setattr(tempfile, "tempdir", str(home))
    assert browser.print_pdf(str(snap), page).read_text() == "<p>the page</p>"


def test_pictures_get_identifiers_of_their_own() -> None:
    text = '<?xml?><svg viewBox="0 0 1 1"><g id="a"/><use href="#a" clip-path="url(#b)"/></svg>'
    found = inline(text, "name", "k", "file")
    assert '<g id="k-a"/><use href="#k-a" clip-path="url(#k-b)"/>' in found
    with pytest.raises(BadInput, match="not a picture"):
        inline("<svg></svg>", "name", "k", "file")


# In a browser


@pytest.fixture(scope="module")
def program() -> str:
    try:
        return browser.find()
    except BadInput:
        pytest.skip("no Chromium, Chrome or Edge is installed")


MEASURE = """<script>
const boxes = [...document.querySelectorAll("main svg[role=img], main img")].map(e => {
  const b = e.getBoundingClientRect(); return [Math.round(b.width), Math.round(b.height)]; });
const wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
const fonts = getComputedStyle(document.body).fontFamily;
document.body.innerHTML = "<pre>" + JSON.stringify({boxes, wide, fonts}) + "</pre>";
</script>"""


def look(program: str, page: Path, *more: str) -> tuple[str, str]:
    """Return the page as a browser has it after loading, and what it wrote on its console."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        command = [program, *browser.arguments(folder), "--enable-logging=stderr", "--v=0", *more,
                   "--dump-dom", page.resolve().as_uri()]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    console = [line for line in done.stderr.splitlines() if ":CONSOLE" in line]
    return done.stdout, "\n".join(console)


def test_the_page_renders(made: Made, program: str, tmp_path: Path) -> None:
    control = tmp_path / "control.html"
    control.write_text("<script>console.error('seen')</script><img src='missing.png'>")
    assert "seen" in look(program, control)[1]  # an error would be noticed
    page = tmp_path / "report.html"
    page.write_text(made.page.replace("</body>", f"{MEASURE}</body>"), encoding="utf-8")
    text, console = look(program, page, "--window-size=1280,900")
    assert console == ""
    found = json.loads(text.partition("<pre>")[2].partition("</pre>")[0].replace("&quot;", '"'))
    assert len(found["boxes"]) == 11
    assert all(width > 600 and height > 200 for width, height in found["boxes"])
    assert found["wide"] <= 0  # nothing has to be scrolled to the side


def test_the_page_prints_on_a4(made: Made, program: str) -> None:
    where = str(made.folder / "printed")
    folders = [str(made.folder / name) for name in ("decision", "before")]
    assert cli.main(["report", *folders, "--out", where, "--pdf"]) == 0
    data = Path(where, "report.pdf").read_bytes()
    assert data.startswith(b"%PDF-") and b"%%EOF" in data[-64:]
    boxes = re.findall(rb"/MediaBox\s*\[([^\]]*)\]", data)
    assert 8 <= len(boxes) <= 25
    for box in boxes:
        assert [round(float(x)) for x in box.split()] == [0, 0, 595, 842]


# Beside the replay


def test_the_first_impact_is_on_a_barrier_or_the_road() -> None:
    site = Site.load("quick")
    wall = rigdda.Wall(x=31.0, height=4.0)
    run, _ = rigdda.release(site, (wall,), 3, "group")
    moment = report_server.first_impact(run, site.road.start)
    assert moment is not None and moment.words == "first impact on a barrier"
    assert moment.time == run.hits(0)["time"].min()
    free, outcome = rigdda.release(site, (), 3, "group")
    moment = report_server.first_impact(free, site.road.start)
    assert outcome.reached and moment is not None and "road" in moment.words
    assert report_server.first_impact(free, 1e3) is None
    part = report_server._since(run, 2.0)
    assert 2.0 <= part.times[0] < 2.0 + 0.1 and part.times[-1] == run.times[-1]
    assert part.poses.shape[0] == part.times.size and dataclasses.asdict(part).keys()


def fetch(address: str, **headers: str) -> tuple[bytes, Any]:
    asked = urllib.request.Request(address, headers=headers)
    with urllib.request.urlopen(asked, timeout=30) as found:
        return found.read(), found.headers


@pytest.mark.skipif(os.name == "nt", reason="sends signals as POSIX has them")
def leave(port: int, asked: str, host: str = "localhost") -> None:
    """Ask for a page and close the connection before the answer, as a browser may."""
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.sendall(f"GET /{asked} HTTP/1.1\r\nHost: {host}:1\r\n\r\n".encode())


def test_connections_that_end_early_are_no_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "missing.html"
    with report_server._Server(("127.0.0.1", 0), report_server._Handler) as server:
        page = ("text/html", b"-" * 100_000)
        files: dict[str, tuple[str, bytes | Path]] = {"/": page, "/gone": ("text/html", missing)}
        server.shown = report_server._Shown(files, "http://127.0.0.1:1")
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        for _ in range(20):
            leave(server.server_port, "")
            leave(server.server_port, "", host="evil.example")
            leave(server.server_port, "nothing")
        for asked, code in (("gone", 404), ("viewer/", 502)):
            with pytest.raises(urllib.error.HTTPError) as error:
                fetch(f"http://127.0.0.1:{server.server_port}/{asked}")
            assert error.value.code == code
            error.value.close()
        assert len(fetch(f"http://127.0.0.1:{server.server_port}/")[0]) == 100_000
        server.shutdown()
        serving.join()
    assert capfd.readouterr() == ("", "")


def test_the_server_shows_both_and_ends_on_ctrl_c(made: Made) -> None:
    command = [sys.executable, "-m", "rigdda.app.cli", "report", "decision", "--serve"]
    default = lambda: signal.signal(signal.SIGINT, signal.default_int_handler)  # noqa: E731
    process = subprocess.Popen(
        command, cwd=made.folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=default,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "decision/report.html\n"
        address = process.stdout.readline().split()[0]
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", address)
        frame, _ = fetch(address)
        assert b"report.html" in frame and b"impact.rrd" in frame
        page, headers = fetch(f"{address}report.html")
        assert page == (made.folder / "decision/report.html").read_bytes()
        assert headers["Content-Security-Policy"].startswith("default-src 'self'")
        assert (
            fetch(f"{address}whole.rrd")[0] == (made.folder / "decision/episode.rrd").read_bytes()
        )
        assert fetch(f"{address}impact.rrd")[0][:3] == b"RRF"
        viewer, headers = fetch(f"{address}viewer/")
        assert b"re_viewer.js" in viewer and b"fonts.googleapis" not in viewer
        assert "https:" not in headers["Content-Security-Policy"]
        assert len(fetch(f"{address}viewer/re_viewer_bg.wasm")[0]) > 1_000_000
        for asked, host, code in (("run.json", "127.0.0.1:1", 404), ("", "evil.example", 403)):
            with pytest.raises(urllib.error.HTTPError) as error:
                fetch(address + asked, Host=host)
            assert error.value.code == code
            error.value.close()
    finally:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert process.returncode == 0 and out == "" and err == ""
    time.sleep(0.2)
    with pytest.raises(OSError):
        fetch(address)
