"""Fit of numbers in a site file to observed run-outs."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import cma
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from rigdda import BadInput, Site, check, fields, release_many
from rigdda.agents.reports.tables import write_rows
from rigdda.files import read as read_text
from rigdda.lumped_mass import lumped
from rigdda.model.site_tables import Rebound

RANGES = {
    "scatter.friction_deg": (0.0, 10.0),
    "friction_deg": (15.0, 65.0),
    "restitution": (0.0, 0.8),
    "damping": (0.0, 3.0),
    "friction_sd_deg": (0.0, 10.0),
    "restitution_sd": (0.0, 0.2),
    "damping_sd": (0.0, 1.0),
    "roughness": (0.0, 0.2),
    "normal": (0.0, 0.8),
    "tangential": (0.4, 1.0),
}
"""Default limits of a parameter, by its path or by the last name of its path."""


class Parameter(NamedTuple):
    """A number of a site file that is fitted, such as `surfaces.soil.restitution`."""

    path: str
    low: float
    high: float


def parse(text: str) -> Parameter:
    """Return a parameter written as PATH or PATH=LOW:HIGH.

    Raises
    ------
    BadInput
        If it has another form, or if it has no limits and there are no default limits for it.
    """
    path, given, limits = text.partition("=")
    if not given:
        usual = RANGES.get(path, RANGES.get(path.rpartition(".")[2]))
        if usual is None:
            raise BadInput("--parameters", text, f"give limits: {path}=LOW:HIGH")
        return Parameter(path, *usual)
    found = re.fullmatch(r"([^:]+):([^:]+)", limits)
    try:
        low, high = map(float, found.groups() if found else ())
    except ValueError:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH") from None
    if not -math.inf < low < high < math.inf:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH, LOW below HIGH")
    return Parameter(path, low, high)


TELLING = {"blocks": ("surfaces", "motion", "scatter"), "lumped": ("lumped", "scatter")}
"""Tables of a site file that affect the run-outs of a model."""


def check_parameters(parameters: Sequence[Parameter], model: str) -> None:
    """Check that the run-outs of a model depend on the parameters and that each is named once.

    Raises
    ------
    BadInput
        If a parameter is repeated or if the run-outs do not depend on it.
    """
    for i, parameter in enumerate(parameters):
        if parameter.path in (other.path for other in parameters[:i]):
            raise BadInput("--parameters", parameter.path, "name each number once")
        if parameter.path.partition(".")[0] not in TELLING[model]:
            known = ", ".join(f"{name}.*" for name in TELLING[model])
            mend = f"run-outs of the model {model} do not depend on it: choose from {known}"
            raise BadInput("--parameters", parameter.path, mend)


def with_values(site: Site, parameters: Sequence[Parameter], values: Sequence[float]) -> Site:
    """Return a copy of a site with other values of some numbers.

    Raises
    ------
    BadInput
        If there is no such number, or if the site is invalid with the value.
    """
    tables = msgspec.to_builtins(site)
    for parameter, value in zip(parameters, values, strict=True):
        *tops, last = parameter.path.split(".")
        table: Any = tables
        for top in tops:
            if top in site.surfaces and table is tables.get("lumped"):
                table.setdefault(top, {})
            table = table.get(top) if isinstance(table, dict) else None
        own = Rebound.__struct_fields__ if tops[:1] == ["lumped"] else ()
        known = isinstance(table, dict) and (last in table or last in own)
        if not known or isinstance(table.get(last, 0.0), str | dict | list | tuple | bool):
            mend = "name a number of the site file, such as surfaces.soil.restitution"
            raise BadInput("--parameters", parameter.path, mend)
        table[last] = float(value)
    return fields.read(Site, tables)


Floats = NDArray[np.float64]
Model = Literal["blocks", "lumped"]


def read(path: Path, site: Site) -> dict[str, Floats]:
    """Return the observed run-outs of each event, as chainages of the site [m].

    Raises
    ------
    BadInput
        If the file is not a table with the columns `run_out_m` and, for a site with several
        events, `event`, or if a run-out is beyond the road, where computed run-outs are cut off.
    """
    if not path.is_file():
        raise BadInput("observed", str(path), "name a CSV file with event and run_out_m")
    found: dict[str, list[float]] = {}
    only = site.event_names[0] if len(site.events) == 1 else ""
    for field, row in _rows(path, only):
        event = row.get("event") or only
        if event not in site.event_names:
            raise BadInput(f"{field} event", event, "choose " + " or ".join(site.event_names))
        found.setdefault(event, []).append(_run_out(f"{field} run_out_m", row["run_out_m"], site))
    if sum(map(len, found.values())) < 3:
        raise BadInput("observed", str(path), "give three observed runs or more")
    return {event: np.array(values) for event, values in found.items()}


def _rows(path: Path, only: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield a name for each row of a table and its cells by column.

    `only` is the event of a site with a single event, otherwise an empty text.
    """
    table = csv.reader(io.StringIO(read_text("observed", path), newline=""))
    try:
        names, *rows = [row for row in table if any(row)] or [[]]
    except csv.Error as error:
        raise BadInput("observed", str(path), f"repair line {table.line_num}: {error}") from None
    if "run_out_m" not in names or not ("event" in names or only):
        mend = "name its columns event and run_out_m in the first row"
        raise BadInput("observed", ", ".join(names), mend)
    if len(set(names)) < len(names):
        raise BadInput("observed", ", ".join(names), "give each column a different name")
    for i, row in enumerate(rows):
        if len(row) != len(names):
            mend = f"give {len(names)} cells, one per column; use a decimal point in numbers"
            raise BadInput(f"observed row {i + 1}", ",".join(row), mend)
        yield f"observed row {i + 1}", dict(zip(names, row, strict=True))


def _run_out(field: str, text: str, site: Site) -> float:
    """Return the run-out of a row of observations [m]."""
    try:
        value = float(text if "_" not in text else "")  # Python would read 4_0 as 40
    except ValueError:
        raise BadInput(field, text, "give a number") from None
    check.number(field, value, site.slope.points[0][0], site.slope.points[-1][0])
    if value > site.road.end:
        mend = f"move road.end beyond it: computed run-outs are cut off at {site.road.end:g} m"
        raise BadInput(field, value, mend)
    return value


def run_outs(site: Site, model: Model, events: Sequence[str], seeds: range) -> dict[str, Floats]:
    """Return the computed run-outs of each event [m]; of a group, that of the farthest block."""
    if model == "lumped":
        found = {event: lumped(site, (), seeds, event) for event in events}
        return {e: np.array([p.run_out[p.release == k].max() for k in range(len(seeds))])
                for e, p in found.items()}  # fmt: skip
    outcomes = release_many([(site, (), seed, event) for event in events for seed in seeds])
    each = np.array([outcome.run_out[2] for outcome in outcomes]).reshape(len(events), len(seeds))
    return dict(zip(events, each, strict=True))


QUANTILES = (0.05, 0.5, 0.95)


class Quality(NamedTuple):
    """Statistics of predicted run-outs and their agreement with the observations [m]."""

    score: float
    mean: float
    quantiles: tuple[float, ...]
    means: Mapping[str, float]
    stopped: float
    """Share of runs that stop uphill of the toe of the slope [-]."""


def scores(computed: Floats, observed: Floats) -> Floats:
    """Return the continuous ranked probability score of each observed run [m]."""
    x = np.sort(computed)
    n = len(x)
    spread = (2.0 * np.arange(1, n + 1) - n - 1) @ x / n**2  # half of the mean distance
    return np.abs(x[None, :] - observed[:, None]).mean(axis=1) - spread


def quality(
    observed: Mapping[str, Floats], predicted: Sequence[Floats], score: float, toe: float
) -> Quality:
    """Return the statistics of a prediction, given as computed run-outs for each observed run."""
    events = [event for event in observed for _ in observed[event]]
    every = np.concatenate(predicted)
    weight = np.concatenate([np.full(len(p), 1.0 / len(p)) for p in predicted]) / len(predicted)
    order = np.argsort(every)
    share = np.cumsum(weight[order])
    quantiles = tuple(float(every[order][np.searchsorted(share, q)]) for q in QUANTILES)
    each = list(zip(predicted, events, strict=True))
    means = {name: float(np.mean([p.mean() for p, e in each if e == name])) for name in observed}
    stopped = float(weight[every < toe].sum())
    return Quality(score, float(weight @ every), quantiles, means, stopped)


def seen(observed: Mapping[str, Floats], toe: float) -> Quality:
    """Return the statistics of the observed run-outs."""
    every = np.concatenate(list(observed.values()))
    quantiles = tuple(float(q) for q in np.quantile(every, QUANTILES))
    means = {event: float(values.mean()) for event, values in observed.items()}
    return Quality(0.0, float(every.mean()), quantiles, means, float((every < toe).mean()))


Compute = Callable[[Floats, range], Mapping[str, Floats]]


class Candidate(NamedTuple):
    """A set of values of the parameters with the computed run-outs of each event [m]."""

    values: Floats
    run_outs: Mapping[str, Floats]


class Trials:
    """Parameter sets that were tried, with the score of each observed run.

    Parameters
    ----------
    observed, parameters, compute
        See `search`.

    Attributes
    ----------
    tried : list of Candidate
        The parameter sets in the order in which they were computed.
    table : list of (runs,) array
        Scores of the observed runs for each parameter set [m].
    """

    def __init__(
        self, observed: Mapping[str, Floats], parameters: Sequence[Parameter], compute: Compute
    ):
        self._observed, self._compute = observed, compute
        self._low = np.array([p.low for p in parameters])
        self._range = np.array([p.high for p in parameters]) - self._low
        self.tried: list[Candidate] = []
        self.table: list[Floats] = []

    def values(self, place: Floats) -> Floats:
        """Return the values of the parameters at a point of the unit cube, (P,)."""
        return self._low + self._range * np.clip(place, 0.0, 1.0)

    def compute(self, values: Floats, seeds: range) -> tuple[Candidate, Floats]:
        """Compute the run-outs for a parameter set and the scores of the observed runs."""
        found = self._compute(values, seeds)
        each = [scores(found[event], self._observed[event]) for event in self._observed]
        return Candidate(values, found), np.concatenate(each)

    def add(self, place: Floats, seeds: range) -> float:
        """Try a point of the unit cube and return its mean score [m]."""
        candidate, each = self.compute(self.values(place), seeds)
        self.tried.append(candidate)
        self.table.append(each)
        return float(each.mean())

    def best(self, count: int) -> list[Candidate]:
        """Return the candidates with the lowest mean scores, the best first."""
        order = np.argsort([each.mean() for each in self.table])[:count]
        return [self.tried[i] for i in order]


def explore(score: Callable[[Floats], float], dimensions: int, budget: int, seed: int) -> None:
    """Minimise a score over the unit cube: first on a Sobol sequence, then by CMA-ES from its best.

    `score` takes a point, (dimensions,), and returns the value to minimise.
    """
    spread = 1 << max(2, round(math.log2(budget / 2)))
    places = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(spread)
    best = places[int(np.argmin([score(place) for place in places]))]
    own = seed % (2**32 - 1) + 1  # cma replaces a seed of 0 by the current time
    options = {"bounds": [0, 1], "seed": own, "verbose": -9, "maxfevals": budget - spread}
    evolution = cma.CMAEvolutionStrategy(best, 0.15, options)
    done = spread
    while budget - done >= evolution.popsize and not evolution.stop():
        asked = evolution.ask()
        evolution.tell(asked, [score(np.asarray(place)) for place in asked])
        done += len(asked)


Tick = Callable[[int, str], None]

FINALISTS, MORE = 8, 4
"""Number of the best candidates that are computed again, and the factor by which their number of
releases is larger."""

FOLDS = 11
"""Number of folds of the cross-validation."""

RESAMPLES = 1000
"""Number of bootstrap samples of the observed runs for the intervals."""


class Fit(NamedTuple):
    """Result of a fit."""

    site: Site
    parameters: tuple[Parameter, ...]
    best: Candidate
    low: Floats
    high: Floats
    """Ends of the 95 % interval of each parameter."""
    fitted: Quality
    validated: Quality
    """Statistics of the cross-validation, which predicts each run by a fit to other runs."""
    left_out: Floats
    """Score of each observed run in the cross-validation, (runs,) [m]."""


def fit(
    site: Site,
    observed: Mapping[str, Floats],
    parameters: Sequence[Parameter],
    budget: int,
    releases: int,
    seed: int,
    tick: Tick,
    model: Model = "blocks",
) -> Fit:
    """Fit parameters of a site to observed run-outs.

    Parameters
    ----------
    site : Site
        The site, which provides the values of all other numbers.
    observed : mapping of event to (n,) array
        Observed run-outs [m], see `read`.
    parameters : sequence of Parameter
        The parameters to fit.
    budget : int
        Largest number of parameter sets that are computed.
    releases : int
        Number of releases of each event for each parameter set.
    seed : int
        Seed of the first release and of the search.
    tick : callable
        Called with the number of completed parameter sets and a description.
    model : {"blocks", "lumped"}
        Model that computes the run-outs.

    Raises
    ------
    BadInput
        If a parameter is unknown, is repeated or has no influence on the run-outs of the model, or
        if the site is invalid at a limit.
    Diverged
        If a simulation diverges.
    """
    check_parameters(parameters, model)
    own = all(surface.damping is not None for surface in site.surfaces.values())
    if own and any(parameter.path == "motion.damping" for parameter in parameters):
        mend = "fit surfaces.NAME.damping: every surface of the site has a damping of its own"
        raise BadInput("--parameters", "motion.damping", mend)
    low, high = (np.array([getattr(p, name) for p in parameters]) for name in ("low", "high"))
    with_values(site, parameters, list(low)), with_values(site, parameters, list(high))
    events = list(observed)

    def compute(values: Floats, seeds: range) -> Mapping[str, Floats]:
        return run_outs(with_values(site, parameters, list(values)), model, events, seeds)

    found = search(site, observed, parameters, compute, budget, releases, seed, tick)
    return found._replace(site=with_values(site, parameters, list(found.best.values)))


def search(
    site: Site,
    observed: Mapping[str, Floats],
    parameters: Sequence[Parameter],
    compute: Compute,
    budget: int,
    releases: int,
    seed: int,
    tick: Tick,
) -> Fit:
    """Fit the parameters of any model of run-outs to observations.

    Parameters
    ----------
    site : Site
        The site, which the fit does not change.
    observed, parameters, budget, releases, seed, tick
        See `fit`.
    compute : callable
        Function of the values of the parameters, (P,), and of seeds that returns the run-outs of
        each event [m].

    Returns
    -------
    Fit
        Result of the fit.
    """
    trials, seeds = Trials(observed, parameters, compute), range(seed, seed + releases)

    def add(place: Floats) -> float:
        score = trials.add(place, seeds)
        tick(len(trials.tried), f"best score {min(map(np.mean, trials.table)):.2f} m")
        return score

    explore(add, len(parameters), budget, seed)
    fresh = range(seed + releases, seed + (1 + MORE) * releases)
    again = [trials.compute(candidate.values, fresh) for candidate in trials.best(FINALISTS)]
    winner, each = min(again, key=lambda pair: float(pair[1].mean()))
    tried, table = trials.tried, np.array(trials.table)
    low, high = _intervals(table, np.array([c.values for c in tried]), seed)
    whole = [winner.run_outs[event] for event in observed for _ in observed[event]]
    left, left_out = _validate(trials, observed, seed, fresh)
    return Fit(
        site,
        tuple(parameters),
        winner,
        np.minimum(low, winner.values),
        np.maximum(high, winner.values),
        quality(observed, whole, float(each.mean()), site.slope.toe),
        quality(observed, left, float(left_out.mean()), site.slope.toe),
        left_out,
    )


def _intervals(table: Floats, values: Floats, seed: int) -> tuple[Floats, Floats]:
    """Return the 95 % interval of each parameter by bootstrap of the observed runs.

    If all parameter sets have the same scores, the interval is the range of all values tried.
    """
    if (table == table[0]).all():
        return values.min(axis=0), values.max(axis=0)
    rng = np.random.default_rng([seed, 1])
    runs = rng.integers(table.shape[1], size=(RESAMPLES, table.shape[1]))
    best = np.array([table[:, chosen].mean(axis=1).argmin() for chosen in runs])
    low, high = np.quantile(values[best], (0.025, 0.975), axis=0)
    return low, high


def _validate(
    trials: Trials, observed: Mapping[str, Floats], seed: int, fresh: range
) -> tuple[list[Floats], Floats]:
    """Cross-validate: return the predicted run-outs of each observed run and its score.

    Each run is predicted by the parameter set that fits the runs of the other folds best, with
    run-outs computed on new seeds.
    """
    events = [event for event in observed for _ in observed[event]]
    table = np.array(trials.table)
    count = table.shape[1]
    parts = np.random.default_rng([seed, 2]).permutation(count) % min(FOLDS, count)
    predicted: list[Floats] = [np.zeros(0)] * count
    left_out = np.zeros(count)
    again: dict[int, tuple[Candidate, Floats]] = {}
    for part in range(min(FOLDS, count)):
        out = np.flatnonzero(parts == part)
        best = int(np.delete(table, out, axis=1).mean(axis=1).argmin())
        if best not in again:
            again[best] = trials.compute(trials.tried[best].values, fresh)
        candidate, each = again[best]
        left_out[out] = each[out]
        for i in out:
            predicted[i] = candidate.run_outs[events[i]]
    return predicted, left_out


NOT_IDENTIFIED = 0.7
"""Length of a 95 % interval, divided by the given range, from which a parameter counts as not
identified [-]. The interval of a parameter without influence is 0.95 of the range."""


def identified(fitted: Fit) -> list[bool]:
    """Return for each parameter whether the observed run-outs identify its value."""
    ends = zip(fitted.parameters, fitted.low, fitted.high, strict=True)
    return [high - low < NOT_IDENTIFIED * (p.high - p.low) for p, low, high in ends]


def rows(fitted: Fit, observed: Mapping[str, Floats]) -> list[dict[str, Any]]:
    """Return rows with the fitted parameters and with the computed and observed statistics."""
    ends = (fitted.parameters, fitted.best.values, fitted.low, fitted.high, identified(fitted))
    out: list[dict[str, Any]] = [
        {
            "what": p.path,
            "unit": "",
            "fitted": v,
            "low": a,
            "high": b,
            "observed": "",
            "left_out": "",
            "identified": "yes" if told else "no",
        }
        for p, v, a, b, told in zip(*ends, strict=True)
    ]
    own, left, real = fitted.fitted, fitted.validated, seen(observed, fitted.site.slope.toe)

    def add(what: str, unit: str, pick: Callable[[Quality], float]) -> None:
        row = {"what": what, "unit": unit, "fitted": pick(own), "low": "", "high": ""}
        out.append(row | {"observed": pick(real), "left_out": pick(left), "identified": ""})

    add("score", "m", lambda q: q.score)
    add("mean run-out", "m", lambda q: q.mean)
    for k, share in enumerate(QUANTILES):
        add(f"{share:.0%} of run-outs", "m", lambda q, k=k: q.quantiles[k])  # type: ignore[misc]
    for event in observed:
        add(f"mean run-out, {event}", "m", lambda q, e=event: q.means[e])  # type: ignore[misc]
    add("stops on the slope", "-", lambda q: q.stopped)
    return out


def write(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write the rows of a fit as a CSV file."""
    write_rows(path, rows(fitted, observed))


def draw(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write a PNG of the cumulative distribution of observed and computed run-outs."""
    from matplotlib.figure import Figure

    from rigdda.agents.reports.pictures import save

    names = ["all", *observed] if len(observed) > 1 else list(observed)
    figure = Figure(figsize=(3.2 * len(names) + 0.6, 3.6), layout="constrained")
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        events = list(observed) if name == "all" else [name]
        real = np.concatenate([observed[e] for e in events])
        weight = [len(observed[e]) / len(real) for e in events]
        grid = np.linspace(min(0.0, real.min()), 1.25 * real.max(), 400)
        share = sum(w * (fitted.best.run_outs[e][:, None] <= grid).mean(axis=0)
                    for w, e in zip(weight, events, strict=True))  # fmt: skip
        half = 1.96 * np.sqrt(share * (1.0 - share) / len(real))
        axes.fill_between(grid, np.clip(share - half, 0, 1), np.clip(share + half, 0, 1),
                          color="#1c5aa0", alpha=0.2, lw=0)  # fmt: skip
        axes.plot(grid, share, color="#1c5aa0", label="computed, 95 % band of samples of this size")
        axes.step(np.sort(real), np.arange(1, len(real) + 1) / len(real), where="post",
                  color="#c0392b", label=f"observed, {len(real)}")  # fmt: skip
        axes.set(xlabel="run-out [m]", title=name, ylim=(0, 1))
    figure.axes[0].set_ylabel("share of runs")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="upper left")
    save(figure, path)
