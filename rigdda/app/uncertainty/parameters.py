"""Uncertain numbers of a site: their paths in the site file, plausible ranges and values.

A fit searches such numbers, and a sensitivity analysis samples them. The ranges of the ground are
those of the library of grounds. The ranges of rates, block sizes, prices and consequences are
factors on the values of the site, see `FACTORS`, as far as the site is valid with them.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Site, check, fields
from rigdda.app.terminal import note
from rigdda.files import is_file
from rigdda.files import read as read_text
from rigdda.ground.grounds import GROUNDS, OTHER, USUAL
from rigdda.ground.surface import RETIRED
from rigdda.model.site_tables import VOLUME_EXPONENT, Rebound

Floats = NDArray[np.float64]

RANGES = {
    "scatter.friction_deg": (0.0, 10.0),
    "friction_deg": (15.0, 65.0),
    "restitution": (0.0, 0.8),
    "rolling": (0.0, 1.0),
    "motion.damping": (0.0, 3.0),
    "friction_sd_deg": (0.0, 10.0),
    "restitution_sd": (0.0, 0.2),
    "rolling_sd": (0.0, 0.3),
    "restitution_speed": (2.0, 50.0),
    "roughness": (0.0, 0.2),
    "normal": (0.0, 0.8),
    "tangential": (0.4, 1.0),
}
"""Default limits of a parameter of a fit, by its path or by the last name of its path. They are
wider than the plausible ranges, because observations decide."""

FACTORS = {"rate": 3.0, "size": 2.0, "level": 1.4, "cost": 2.0}
"""Factor by which a number may be larger or smaller than assumed: the rate of an event, the volume
of its blocks, the level of the prices of barriers, and a cost or duration of the consequences.
Inventories of rockfall seldom give rates to better than a factor of three; all factors are
assumed."""

INTEREST = (0.01, 0.05)
"""Plausible real rates of interest of public works [1/year]."""

GROUPS = ("ground", "sizes", "rates", "prices")
"""Groups of parameters that can be named instead of paths."""


class Parameter(NamedTuple):
    """An uncertain number of a site file, such as `surfaces.soil.restitution`.

    Parameters
    ----------
    path : str
        Path of the number. Besides numbers of the file, `events.NAME.size` and `sources.NAME.size`
        are factors on the volumes of blocks, and `prices.level` is a factor on the prices of all
        barriers.
    low, high : float
        Its limits.
    logarithmic : bool
        Whether values are evenly distributed on a logarithmic scale, as factors are.
    """

    path: str
    low: float
    high: float
    logarithmic: bool = False

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the numbers that it determines."""
        return (self.path,)

    def at(self, place: float) -> tuple[float, ...]:
        """Return its value at a place between 0 (`low`) and 1 (`high`)."""
        if self.logarithmic:
            return (self.low * (self.high / self.low) ** place,)
        return (self.low + (self.high - self.low) * place,)


def parse(text: str, known: Mapping[str, Parameter] | None = None) -> Parameter:
    """Return a parameter written as PATH or PATH=LOW:HIGH.

    Parameters
    ----------
    text : str
        The text.
    known : mapping of str to Parameter, optional
        Parameters with limits by their paths; by default the limits are those of `RANGES`.

    Raises
    ------
    BadInput
        If it has another form, or if it has no limits and there are no default limits for it.
    """
    path, given, limits = text.partition("=")
    _check_retired(path)
    if not given:
        if known and path in known:
            return known[path]
        usual = RANGES.get(path, RANGES.get(path.rpartition(".")[2]))
        if usual is None:
            raise BadInput("--parameters", text, f"give limits: {path}=LOW:HIGH")
        return Parameter(path, *usual)
    found = re.fullmatch(r"([^:]+):([^:]+)", limits)
    try:
        low, high = map(check.parsed, found.groups() if found else ())
    except ValueError:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH") from None
    if not -math.inf < low < high < math.inf:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH, LOW below HIGH")
    return Parameter(path, low, high)


def _check_retired(path: str) -> None:
    """Check that a path does not name a former key of a surface or an interface.

    Raises
    ------
    BadInput
        If it does.
    """
    top, last = path.partition(".")[0], path.rpartition(".")[2]
    if top in ("surfaces", "interfaces") and last in RETIRED:
        hint = f"name {path.rpartition('.')[0]}.{last.replace('damping', 'rolling')}: damping was "
        raise BadInput("--parameters", path, hint + "replaced by rolling resistance")


def check_once(parameters: Sequence[Parameter]) -> None:
    """Check that each number is named once.

    Raises
    ------
    BadInput
        If one is repeated.
    """
    for i, parameter in enumerate(parameters):
        if parameter.path in (other.path for other in parameters[:i]):
            raise BadInput("--parameters", parameter.path, "name each number once")


def ground(site: Site) -> tuple[Parameter, ...]:
    """Return rolling resistance, restitution and friction of each surface of the slope.

    The ranges are those of the ground of the surface in the library, or of the ground that a
    surface with this name usually has. They are extended to contain the value of the site.
    """
    found = []
    for name in dict.fromkeys(site.slope.chain()[1]):
        surface = site.surfaces[name]
        spans = GROUNDS[surface.ground or USUAL.get(name, OTHER)]
        for field in ("rolling", "restitution", "friction_deg"):
            value, span = getattr(surface, field), getattr(spans, field)
            if value is not None:
                path = f"surfaces.{name}.{field}"
                found.append(Parameter(path, min(span.low, value), max(span.high, value)))
    return tuple(found)


def plausible(site: Site, layout: Layout) -> dict[str, tuple[Parameter, ...]]:
    """Return the uncertain numbers of a site with a layout by `GROUPS`.

    Numbers without influence are left out: rates and costs of 0, and prices without barriers. So
    are numbers that have no other valid value on this site, see `unvaried`. Barriers that stand
    already have prices, too, for upkeep and repair.
    """
    groups = _assumed(site, layout)
    return {name: tuple(one for one in own if _varies(one)) for name, own in groups.items()}


def unvaried(names: Sequence[str], site: Site, layout: Layout) -> list[str]:
    """Return in words which numbers of some groups cannot be varied, and why.

    Parameters
    ----------
    names : sequence of str
        Names of groups or of single numbers, which are ignored; all groups without names.
    site, layout : Site, Layout
        The site and the layout.
    """
    groups = _assumed(site, layout)
    asked = [name for name in GROUPS if name in (names or GROUPS)]
    used = {event.source for event in site.events}
    surveyed = [source.name for source in site.sources if source.blocks and source.name in used]
    found = [
        f"the volumes of the blocks of source {name!r}, whose corners are surveyed"
        for name in surveyed
        if "sizes" in asked
    ]
    fixed = [one.path for name in asked for one in groups[name] if not _varies(one)]
    return found + [f"{path}, which has no other valid value on this site" for path in fixed]


NARROWEST = 1e-6
"""Length of a range relative to its ends from which it is more than rounding [-]."""


def _varies(one: Parameter) -> bool:
    """Return whether a parameter has more than one value."""
    return one.high - one.low > NARROWEST * max(abs(one.low), abs(one.high))


def _assumed(site: Site, layout: Layout) -> dict[str, tuple[Parameter, ...]]:
    """Return the uncertain numbers of a site by `GROUPS`, with the ranges that it permits.

    The limits of a number that has no other valid value on the site are equal but for rounding.
    """
    sizes = [_factor(f"events.{e.name}.size", 1.0, "size") for e in site.events if e.area]
    sized = (s for s in site.sources if s.edges is not None or s.polygon)
    sizes += [_factor(f"sources.{source.name}.size", 1.0, "size") for source in sized]
    rates = [_factor(f"events.{e.name}.rate", e.rate, "rate") for e in site.events if e.rate > 0.0]
    factors = (sizes, rates, _money(site, layout))
    permitted = (tuple(_permitted(site, one) for one in group) for group in factors)
    return dict(zip(GROUPS, (ground(site), *permitted), strict=True))


def _money(site: Site, layout: Layout) -> list[Parameter]:
    """Return the uncertain prices and consequences of a site with a layout."""
    harm = site.consequences
    found = [
        _factor(f"consequences.{name}", getattr(harm, name), "cost")
        for name in ("closure", "days_base", "days_factor", "clearing")
        if getattr(harm, name) > 0.0
    ]
    if layout:
        low, high = min(INTEREST[0], site.prices.interest), max(INTEREST[1], site.prices.interest)
        found.append(Parameter("prices.interest", low, high))
    if site.standing(layout) or layout:
        found.append(_factor("prices.level", 1.0, "level"))
        if site.prices.removal > 0.0:
            found.append(_factor("prices.removal", site.prices.removal, "cost"))
    return found


def _factor(path: str, value: float, kind: str) -> Parameter:
    """Return a number that may be larger or smaller by a factor of `FACTORS`."""
    factor = FACTORS[kind]
    return Parameter(path, value / factor, value * factor, True)


HALVINGS = 30
"""Number of halvings of the interval in which the end of the permitted values of a number lies."""


def _permitted(site: Site, one: Parameter) -> Parameter:
    """Return a parameter with its range limited to values with which the site is valid.

    Parameters on a logarithmic scale have the value of the site, which is valid, in the middle of
    their range.
    """
    if not one.logarithmic:
        return one
    low, high = (_farthest(site, one, end) for end in (0.0, 1.0))
    return one._replace(low=low, high=high)


def _farthest(site: Site, one: Parameter, end: float) -> float:
    """Return the value nearest to an end of a range (place 0 or 1) with which the site is valid."""
    if _is_valid(site, one, end):
        return one.low if end == 0.0 else one.high
    sound, unsound = 0.5, end
    for _ in range(HALVINGS):
        middle = 0.5 * (sound + unsound)
        if _is_valid(site, one, middle):
            sound = middle
        else:
            unsound = middle
    return one.at(sound)[0]


def _is_valid(site: Site, one: Parameter, place: float) -> bool:
    """Return whether a site is valid with the value of a parameter at a place of its range."""
    try:
        set_numbers(site, one.paths, one.at(place))
    except BadInput:
        return False
    return True


def choose(names: Sequence[str], site: Site, layout: Layout) -> tuple[Parameter, ...]:
    """Return the parameters that are named by groups or as PATH or PATH=LOW:HIGH.

    Without names, all plausible parameters are returned.

    Raises
    ------
    BadInput
        If a name is unknown or repeated, or if the site is invalid at a limit.
    """
    groups = plausible(site, layout)
    known = {parameter.path: parameter for group in groups.values() for parameter in group}
    found: list[Parameter] = []
    for name in names or GROUPS:
        found += groups[name] if name in groups else (parse(name, known),)
    check_once(found)
    check_limits(site, found)
    return tuple(found)


def check_limits(site: Site, parameters: Sequence[Parameter]) -> None:
    """Check that a site is valid at both limits of each parameter.

    Raises
    ------
    BadInput
        If it is not, or there is no such number.
    """
    for parameter in parameters:
        for value in (parameter.low, parameter.high):
            _set_or_name(
                site, (parameter.path,), (value,), "choose a limit with which the site is valid"
            )


def _set_or_name(
    site: Site, paths: Sequence[str], values: Sequence[float], remedy: str,
    field: str = "--parameters",
) -> Site:  # fmt: skip
    """Return a site with other values of some numbers, see `set_numbers`.

    Raises
    ------
    BadInput
        As `set_numbers` does; if the site is invalid, the message names the numbers and their
        values, because the value in question may be one that they only affect.
    """
    try:
        return set_numbers(site, paths, values)
    except BadInput as bad:
        if bad.field == "--parameters":
            raise
        given = ", ".join(f"{p} = {v:g}" for p, v in zip(paths, values, strict=True))
        raise BadInput(field, given, f"{remedy} ({bad})") from None


def with_values(site: Site, parameters: Sequence[Parameter], values: Sequence[float]) -> Site:
    """Return a copy of a site with other values of some parameters; see `set_numbers`."""
    return set_numbers(site, [parameter.path for parameter in parameters], values)


def set_numbers(site: Site, paths: Sequence[str], values: Sequence[float]) -> Site:
    """Return a copy of a site with other values of the numbers with some paths.

    Factors multiply these values, in whatever order the paths are given.

    Raises
    ------
    BadInput
        If there is no such number, or if the site is invalid with the value.
    """
    tables = msgspec.to_builtins(site)
    for path, value in sorted(zip(paths, values, strict=True), key=lambda one: _is_factor(one[0])):
        _set(site, tables, path, float(value))
    return fields.read(Site, tables)


def _is_factor(path: str) -> bool:
    """Return whether a path names a factor on numbers of the site, see `Parameter`."""
    top, last = path.partition(".")[0], path.rpartition(".")[2]
    return path == "prices.level" or (last == "size" and top in ("events", "sources"))


def _set(site: Site, tables: dict[str, Any], path: str, value: float) -> None:
    """Set a number in the tables of a site."""
    top, last = path.partition(".")[0], path.rpartition(".")[2]
    _check_retired(path)
    if path == "motion.damping" and site.motion.damping_when == "contact":
        hint = "name surfaces.NAME.rolling: damping in contact was replaced by rolling resistance"
        raise BadInput("--parameters", path, hint)
    if path == "prices.level":
        return _scale_prices(tables, value)
    table = _table(site, tables, path)
    if _is_factor(path) and table is not None:
        scale = _scale_event if top == "events" else _scale_source
        return scale(site, path, table, value)
    own = Rebound.__struct_fields__ if top == "lumped" else ()
    known = table is not None and (last in table or last in own)
    if table is None or not known:
        raise _unknown(path)
    if isinstance(table.get(last, 0.0), str | dict | list | tuple | bool):
        raise _unknown(path)
    table[last] = value
    return None


def _unknown(path: str) -> BadInput:
    hint = "name a number of the site file, such as surfaces.soil.restitution"
    return BadInput("--parameters", path, hint)


def _table(site: Site, tables: dict[str, Any], path: str) -> dict[str, Any] | None:
    """Return the table of a site that holds the number with a path, None if there is none."""
    tops = path.split(".")[:-1]
    if tops and isinstance(tables.get(tops[0]), list | tuple):  # tables with names, as events
        name = path.partition(".")[2].rpartition(".")[0]
        named = (t for t in tables[tops[0]] if isinstance(t, dict) and t.get("name") == name)
        return next(named, None)
    table: Any = tables
    for top in tops:
        if not isinstance(table, dict):
            return None
        if table is tables["lumped"] and top in site.surfaces:
            table.setdefault(top, {})
        table = table.get(top)
    return table if isinstance(table, dict) else None


def _scale_prices(tables: dict[str, Any], factor: float) -> None:
    """Multiply the prices of all barriers by a factor."""
    prices = tables["prices"]
    for name in ("fence", "ditch"):
        prices[name] = {kind: factor * price for kind, price in prices[name].items()}
    for name in ("fence_base", "ditch_base", "embankment", "concrete"):
        prices[name] *= factor
    for mesh in tables["meshes"]:
        mesh["price"] *= factor


def _scale_event(site: Site, path: str, table: dict[str, Any], factor: float) -> None:
    """Multiply the volumes of the blocks of an event by a factor, whatever their distribution."""
    if table["area"] is None:
        source = site.source(table["source"])
        hint = f"name sources.{source.name}.size: the source determines the blocks"
        if source.blocks:
            hint = f"leave it out: the blocks of source {source.name} are surveyed"
        raise BadInput("--parameters", path, hint)
    if table["volumes"] is not None:
        table["volumes"] = [factor * volume for volume in table["volumes"]]
        table["area"] = None  # it follows from the volumes
        return
    if table["volume_median"] is not None:
        table["volume_median"] *= factor
    table["area"] = [factor**VOLUME_EXPONENT * area for area in table["area"]]


def _scale_source(site: Site, path: str, table: dict[str, Any], factor: float) -> None:
    """Multiply the volumes of the blocks of a source by a factor."""
    area, length = factor**VOLUME_EXPONENT, factor ** (VOLUME_EXPONENT / 2.0)
    if table["edges"] is not None:
        table["edges"] = [length * edge for edge in table["edges"]]
    elif table["block_area"] is not None:
        table["block_area"] *= area
    elif table["joints"]:
        table["joints"] = [j | {"spacing": length * j["spacing"]} for j in table["joints"]]
    elif table["blocks"]:
        raise BadInput("--parameters", path, "leave it out: the blocks of this source are surveyed")
    else:
        own = [f"events.{e.name}.size" for e in site.events if e.source == table["name"]]
        hint = f"name {' or '.join(own)}" if own else "leave it out"
        raise BadInput("--parameters", path, f"{hint}: events determine the blocks of this source")


WEIGHT = "weight"
"""Name of the column of weights in a posterior file."""


class Posterior(NamedTuple):
    """Samples of several numbers of a site from their joint distribution after a fit.

    In a sensitivity analysis it counts as one input, because the numbers depend on one another.

    Parameters
    ----------
    paths : tuple of str
        Paths of the numbers.
    values : (S, P) array
        Samples, in the order of their first principal component.
    weights : (S,) array
        Their weights, which add up to 1.
    """

    paths: tuple[str, ...]
    values: Floats
    weights: Floats

    @property
    def path(self) -> str:
        """Name of the input."""
        return f"posterior of {', '.join(self.paths)}"

    @classmethod
    def of(cls, paths: Sequence[str], values: Floats, weights: Floats) -> Posterior:
        """Return samples in order with weights that add up to 1, without those of weight 0."""
        kept = weights > 0.0
        values, weights = values[kept], weights[kept] / weights.sum()
        spread = values.std(axis=0)
        scaled = (values - values.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
        *_, axes = np.linalg.svd(scaled, full_matrices=False)
        order = np.argsort(scaled @ axes[0] * np.sign(axes[0][0] or 1.0), kind="stable")
        return cls(tuple(paths), values[order], weights[order])

    def at(self, place: float) -> tuple[float, ...]:
        """Return the sample at a place between 0 and 1 in the cumulative weight."""
        share = np.cumsum(self.weights)
        i = int(np.searchsorted(share, place * share[-1]))
        return tuple(self.values[min(i, len(share) - 1)].tolist())

    def interval(self, level: float) -> tuple[Floats, Floats]:
        """Return the ends (P,) of the central intervals that hold the weight `level`."""
        tails = 0.5 * (1.0 - level), 0.5 * (1.0 + level)
        ends = []
        for tail in tails:
            each = []
            for column in self.values.T:
                order = np.argsort(column, kind="stable")
                share = np.cumsum(self.weights[order])
                i = min(int(np.searchsorted(share, tail * share[-1])), len(share) - 1)
                each.append(column[order][i])
            ends.append(np.array(each))
        return ends[0], ends[1]

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows of its file."""
        return [
            {WEIGHT: float(weight)} | dict(zip(self.paths, row.tolist(), strict=True))
            for weight, row in zip(self.weights, self.values, strict=True)
        ]


def read_posterior(path: Path, site: Site) -> Posterior:
    """Read a posterior file, as `rigdda fit` writes it.

    Raises
    ------
    BadInput
        If there is no such file, or it is not a table of weights and valid numbers of the site.
    """
    if not is_file(path):
        raise BadInput("--posterior", str(path), "name a file posterior.csv of `rigdda fit`")
    try:
        head, *rows = csv.reader(io.StringIO(read_text("--posterior", path), newline=""))
        table = np.array([[check.parsed(cell) for cell in row] for row in rows], dtype=np.float64)
    except (ValueError, csv.Error):
        table, head = np.zeros(0), [""]
    hint = "give a column weight and one for each number, with finite numbers and weights above 0"
    if table.ndim != 2 or head[0] != WEIGHT or table.shape[1] != len(head) or len(head) < 2:
        raise BadInput("--posterior", str(path), hint)
    if not np.isfinite(table).all() or (table[:, 0] < 0.0).any() or not table[:, 0].any():
        raise BadInput("--posterior", str(path), hint)
    check.distinct("--posterior", head)
    for ends in (table.min(axis=0), table.max(axis=0)):
        set_numbers(site, head[1:], ends[1:].tolist())
    return Posterior.of(head[1:], table[:, 1:], table[:, 0])


Input = Parameter | Posterior
"""An input of a sensitivity analysis, with its `path`, `paths` and values `at` a place."""


def site_at(
    site: Site,
    inputs: Sequence[Input],
    place: Floats,
    field: str = "--parameters",
    remedy: str = "choose narrower limits, with which the site is valid",
) -> Site:
    """Return a site with the values of inputs at a place of the unit cube, (D,).

    Raises
    ------
    BadInput
        If the site is invalid with these values together. The error has this field and remedy, and
        names the inputs.
    """
    paths = [path for one in inputs for path in one.paths]
    values = [v for one, at in zip(inputs, place.tolist(), strict=True) for v in one.at(at)]
    return _set_or_name(site, paths, values, remedy, field)


def inputs(
    names: Sequence[str], site: Site, layout: Layout, posterior: Path | None = None
) -> tuple[Input, ...]:
    """Return the inputs of an analysis: those of `choose`, and a posterior instead of its numbers.

    A note names the numbers of the groups that cannot be varied.

    Raises
    ------
    BadInput
        As `choose` and `read_posterior` do, or if no number of the groups can be varied.
    """
    chosen: tuple[Input, ...] = choose(names, site, layout)
    if posterior is not None:
        joint = read_posterior(posterior, site)
        chosen = (joint, *(one for one in chosen if one.path not in joint.paths))
    left = "; ".join(unvaried(names, site, layout))
    if not chosen:
        hint = "name other numbers or groups: no number of these can be varied on this site"
        asked = ", ".join(names or GROUPS)
        raise BadInput("--parameters", asked, f"{hint} ({left})" if left else hint)
    note(f"not varied: {left}" if left else "")
    return chosen
