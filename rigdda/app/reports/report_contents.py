"""Tables and pictures of results folders that the report shows, with their titles and columns."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass

from rigdda import BadInput
from rigdda.app.reports.html_blocks import (
    Column,
    Row,
    bounded,
    interval,
    mixed,
    money,
    plain,
    spread,
    value,
    words,
)
from rigdda.app.reports.stations import ALL_EVENTS, PASSING_RATE, QUANTITIES
from rigdda.app.reports.stations import PRINTED as MAIN
from rigdda.app.reports.wording import (
    euros,
    percent,
    small,
    tenth,
)
from rigdda.barriers import describe, from_table

PER_YEAR = "EUR per metre of road and year"
"""Unit of annual costs."""


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A table or picture of a results folder that is shown in a section.

    Parameters
    ----------
    section : str
        Name of the section.
    files : str
        Name of the file, or a pattern such as "station_*.png". Of a picture that ends in .png, the
        vector picture beside it is shown.
    title, words : str
        Title and explanation. In the title, {part} is what the star in the pattern stands for.
    columns : tuple of Column
        Columns of a table; by default all of the file.
    shown : callable
        Function of a row that returns whether the row is shown.
    command : str
        Command whose file is meant; empty if any.
    """

    section: str
    files: str
    title: str
    words: str = ""
    columns: tuple[Column, ...] = ()
    shown: Callable[[Row], bool] = lambda row: True
    command: str = ""


def _main(row: Row) -> bool:
    """Return whether a row of the table of stations is shown: of single events only the main."""
    return row["event"] == ALL_EVENTS or row["quantity"] in (*MAIN, PASSING_RATE)


def _called(name: str, barriers: str) -> str:
    """Return the name of a layout with its barriers."""
    bare = ("", "no barrier", name)
    return name if barriers in bare else f"{name}: {barriers}"


def _barriers(text: str) -> str:
    """Return the barriers of a JSON list of tables, as in a layout file, in words."""
    try:
        found = [from_table(f"barriers[{i}]", row) for i, row in enumerate(json.loads(text))]
    except (ValueError, TypeError, BadInput):
        return text
    return "; ".join(map(describe, found)) or "no new barrier"


def _budget(text: str) -> str:
    """Return a budget: an amount of money, or the word that stands for none."""
    try:
        return euros(float(text))
    except ValueError:
        return text


def _quantity(name: str, unit: str) -> str:
    """Return the name of a quantity with its unit."""
    said = QUANTITIES[name].words if name in QUANTITIES else name.replace("_", " ")
    return f"{said} [{unit}]"


EXHIBITS = (
    Exhibit(
        "passing",
        "section.png",
        "Trajectories and envelopes",
        "Some trajectories of each event to scale, and the heights and energies that 95 % of the "
        "passing blocks do not exceed, from all releases.",
        command="simulate",
    ),
    Exhibit(
        "passing",
        "stations.csv",
        "What passes the stations",
        "Means, and quantiles with the ends of their 95 % intervals, from n passing blocks; “?” "
        "marks an end for which there are too few blocks. Energies are those of a whole block. The "
        "passing rate counts releases with at least one passing block.",
        (
            value("x [m]", "x_m", plain),
            words("event", "event"),
            Column("quantity", ("quantity", "unit"), _quantity, number=False),
            value("n", "n"),
            value("mean", "mean"),
            value("50 %", "q50"),
            value("90 %", "q90"),
            interval("95 %", "q95"),
            interval("99 %", "q99"),
        ),
        _main,
    ),
    Exhibit("passing", "station_*m.png", "Histograms at x = {part} m",
            "Shares of the passing blocks, and the quantiles over all events."),
    Exhibit("passing", "along_slope.png", "Along the slope",
            "Quantiles over all events, and how often a release passes."),
    Exhibit("passing", "run_out.png", "Run-out",
            "How often rock stops beyond each chainage, also beyond the road."),
    Exhibit(
        "passing",
        "stopping.csv",
        "Run-out of half and of 95 % of the rock",
        "Chainage within which this share of the rock of all releases comes to rest, also beyond "
        "the road, with its 95 % interval. Blocks count by mass, and events by rate. It is a lower "
        "bound if it depends on rock that left the surveyed ground or still moved at the end, of "
        "which the shares are given.",
        (
            words("event", "event"),
            value("share of the rock", "share", percent),
            interval("x [m]", "x_m", tenth),
            words("", "bound"),
            value("left the ground", "left", percent),
            value("still moving", "moving", percent),
            value("releases", "releases"),
            value("blocks", "n"),
        ),
    ),
    Exhibit(
        "layouts",
        "layouts.csv",
        "Cost of each layout",
        f"Z is the sum of capital and upkeep, expected harm on the road and expected repair, in "
        f"{PER_YEAR} with 95 % intervals. To build: EUR per metre of road. Debris: volume on the "
        "road, relative to the first layout. rule: the fence of UNI 11211-4; rock shed: a "
        "reference with full protection. All layouts were verified on the same number of releases "
        "that the search did not use.",
        (
            Column("layout", ("layout", "barriers"), _called, number=False),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            interval("harm", "harm", euros),
            interval("repair", "repair", euros),
            money("to build", "cost"),
            value("debris", "debris_share", percent),
            words("targets", "targets"),
            value("releases", "releases"),
        ),
        command="design",
    ),
    Exhibit(
        "layouts",
        "chances.csv",
        "Probabilities by event",
        "Probability that a block of a release reaches the road and that a barrier fails, with "
        "one-sided 95 % upper bounds, from the given number of releases; and the expected harm and "
        f"repair of the event in {PER_YEAR}.",
        (
            words("event", "event"),
            words("design event", "design"),
            words("layout", "layout"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            money("harm and repair", "cost"),
            value("releases", "releases"),
        ),
    ),
    Exhibit("layouts", "section.png", "The slope without and with the layout",
            "Some trajectories of each event to scale. Below them, the heights and energies that "
            "95 % of the passing blocks do not exceed without the layout.", command="design"),
    Exhibit("layouts", "cost.png", "Cost and risk",
            "Annual capital cost of layouts against their remaining risk. Z is the same along the "
            "thin lines."),
    Exhibit(
        "layouts",
        "layouts.csv",
        "Cost of each layout of the study",
        f"Z is the sum of capital and upkeep, expected harm on the road and expected repair, in "
        f"{PER_YEAR} with 95 % intervals. To build: EUR per metre of road.",
        (
            words("layout", "layout"),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            interval("harm", "harm", euros),
            interval("repair", "repair", euros),
            money("to build", "cost"),
        ),
        command="study",
    ),
    Exhibit(
        "layouts",
        "events.csv",
        "Probabilities and energies by event",
        "Probability that a block of a release reaches the road and that a barrier fails, with "
        "one-sided 95 % upper bounds; 95 % quantiles of the largest energy of a block on the road "
        "and of the largest energy of a hit in kJ per metre of width; harm and repair of the event "
        f"in {PER_YEAR}.",
        (
            words("event", "event"),
            words("layout", "layout"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            money("on the road", "energy_on_road_95"),
            money("hit", "energy_of_hit_95"),
            money("harm and repair", "harm_and_repair"),
            value("releases", "releases"),
        ),
        command="study",
    ),
    Exhibit(
        "layouts",
        "differences.csv",
        "Differences of layouts",
        f"Z of the first layout minus Z of the second in {PER_YEAR}, with 95 % intervals on common "
        "releases.",
        (
            words("layout", "one"),
            words("minus", "two"),
            spread("difference", ("difference", "low", "high"), euros),
            words("they differ", "differ"),
            value("releases", "releases"),
        ),
        command="study",
    ),
    Exhibit("layouts", "sections.png", "Layouts of the study in section", command="study"),
    Exhibit("layouts", "costs.png", "Costs of the layouts of the study", command="study"),
    Exhibit(
        "layouts",
        "worst.csv",
        "The worst releases of the study",
        "Releases with the most energy on the road, and releases in which a barrier fails. "
        "The command rigdda replay shows each of them if it is given the event and the seed.",
        (
            words("layout", "layout"),
            words("why", "why"),
            words("event", "event"),
            value("seed", "seed"),
            value("energy on the road [kJ/m]", "energy_on_road"),
            value("volume on the road [m3]", "road_volume"),
        ),
        command="study",
    ),
    Exhibit("layouts", "worst.png", "The worst releases of the study in section", command="study"),
    Exhibit(
        "layouts",
        "costs.csv",
        "Costs with other prices, rates or consequences",
        f"The layouts of the design, priced anew. Z and its parts in {PER_YEAR}; to build: EUR per "
        "metre of road.",
        (
            words("layout", "layout"),
            interval("Z", "objective", euros),
            money("capital", "capital"),
            money("harm", "harm"),
            money("repair", "repair"),
            money("to build", "cost"),
            words("targets", "targets"),
            words("meets its checks", "meets_checks"),
            words("verified", "verified"),
            value("releases", "releases"),
        ),
        command="reprice",
    ),
    Exhibit(
        "checks",
        "checks.csv",
        "Checks of the barriers",
        "Demand and capacity of each barrier, and their ratio (use) beside its limit.",
        (
            words("barrier", "barrier"),
            value("x [m]", "x_m", plain),
            words("check", "check"),
            value("demand", "demand"),
            value("capacity", "capacity"),
            words("unit", "unit"),
            value("use", "use"),
            value("limit", "limit"),
            words("satisfied", "satisfied"),
            words("note", "note"),
        ),
    ),
    Exhibit(
        "checks",
        "design_sheet.csv",
        "Design sheets of the fences",
        "The design of each fence, factor by factor.",
        (
            words("layout", "layout"),
            words("fence", "fence"),
            words("quantity", "quantity"),
            words("symbol", "symbol"),
            mixed("value", "value"),
            words("unit", "unit"),
            words("basis", "basis"),
        ),
    ),
    Exhibit("checks", "demand.png", "What the rule demands along the slope",
            "Class and height of a fence that the engineering rule demands at each chainage."),
    Exhibit(
        "risk",
        "risk.csv",
        "Risk to life and traffic of each layout",
        "Expected numbers per year on the section of road below the site, with 95 % intervals: "
        "vehicles that falling rock hits, vehicles that run into debris, deaths, deaths per km of "
        "road, and the probability that one commuter is killed.",
        (
            words("layout", "layout"),
            interval("vehicles hit", "hit", small),
            interval("run into debris", "run_into", small),
            interval("deaths", "fatalities", small),
            interval("deaths per km", "per_km", small),
            interval("one commuter", "individual", small),
        ),
    ),
    Exhibit("sureness", "sensitivity.csv", "Sensitivity to the inputs",
            "Influence of each input on each output, the most important first."),
    Exhibit("sureness", "tornado.png", "Sensitivity to the inputs",
            "Average change of the outputs over the range of each input, and the index of each."),
    Exhibit("sureness", "band.csv", "The layouts on other grounds",
            f"Z in {PER_YEAR} and probabilities of each layout on grounds within the plausible "
            "range."),
    Exhibit("sureness", "band.png", "The layouts on other grounds",
            "Z of each layout on each ground, ordered by Z of the first layout."),
    Exhibit("sureness", "fit.csv", "Fit to observations",
            "Fitted numbers with 95 % intervals, and how well the fit predicts observations that "
            "were left out."),
    Exhibit("sureness", "fit.png", "Fit to observations"),
    Exhibit(
        "frontier",
        "frontier.csv",
        "Cheapest layouts for each probability",
        "The cheapest layout that was evaluated for each probability that a block of a design "
        "event reaches the road, with one-sided 95 % upper bounds. To build: EUR per metre of "
        f"road. Z is given in {PER_YEAR} for the layouts that were verified.",
        (
            Column("layout", ("barriers",), _barriers, number=False),
            money("to build", "cost"),
            bounded("reaches the road", "reach"),
            bounded("a barrier fails", "failure"),
            interval("Z", "objective", euros),
            words("verified", "verified"),
            value("releases", "releases"),
        ),
    ),
    Exhibit("frontier", "frontier.png", "Cost and probability",
            "Probability that a block reaches the road against the cost to build."),
    Exhibit(
        "corridor",
        "budgets.csv",
        "What each budget achieves",
        "Money spent in EUR and gain in EUR per year, with 95 % intervals; the gain as a share of "
        "the gain with unlimited money; and what one more EUR would save each year.",
        (
            Column("budget", ("budget",), _budget, number=False),
            words("method", "method"),
            money("spent", "spent"),
            interval("gain", "gain", euros),
            value("share", "share_of_unlimited", percent),
            value("sections built", "sections_built"),
            value("sections that may miss a target", "sections_missing_targets"),
            value("one more EUR saves", "shadow_price"),
        ),
    ),
    Exhibit("corridor", "gain.png", "Gain and budget"),
    Exhibit("corridor", "strip.png", "What is built along the corridor"),
    Exhibit(
        "corridor",
        "sections.csv",
        "What is built in each section",
        f"Cost and gain of a section in EUR and EUR per year; Z in {PER_YEAR}.",
        (
            Column("budget", ("budget",), _budget, number=False),
            words("section", "section"),
            value("length [m]", "length", plain),
            words("layout", "layout"),
            money("cost", "cost"),
            interval("gain", "gain", euros),
            interval("Z", "Z", euros),
            money("Z without", "Z_without_barriers"),
            value("P(reach)", "reach", percent),
        ),
    ),
    Exhibit("corridor", "priorities.csv", "What should be built next"),
)  # fmt: skip
"""Tables and pictures of results folders, in the order of the report. A new table or picture needs
an entry here; tables without an entry are listed in the appendix."""
