"""Fit a site to run-outs that were observed there: which numbers of its file explain them best.

Computed run-outs are a sample of what the site may do, an observed one is a single draw of what it
did. The two are compared by the continuous ranked probability score (Gneiting and Raftery 2007),
the mean distance of observed from computed ones less half of their own mean distance [m]. It is
least in expectation for the distribution that the observed run-outs came from.

Half of the budget is spread over the box of parameters (Sobol), the other half follows CMA-ES from
the best of them; all releases have the same seeds. The best ones are computed again on fresh
seeds, to choose without luck. Every interval and the cross-validation choose among all that were
computed, by resampled or left-out observed runs: neither costs a release.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import cma
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from agents.tables import write_rows
from rigdda import BadInput, Site, check, release_many
from rigdda.lumped import lumped
from rigdda.model.place import Rebound

Floats = NDArray[np.float64]
Model = Literal["blocks", "lumped"]
Tick = Callable[[int, str], None]

RANGES = {
    "friction_deg": (15.0, 65.0),
    "restitution": (0.0, 0.8),
    "damping": (0.0, 2.0),
    "normal": (0.0, 0.8),
    "tangential": (0.4, 1.0),
}
"""Where to look for a field that comes without limits."""

FINALISTS, MORE = 8, 4
"""How many of the best are computed again, on how many times the releases."""

FOLDS = 11
"""Parts of the observed runs that are left out in turn."""

RESAMPLES = 1000
"""Of the observed runs, for intervals."""

QUANTILES = (0.05, 0.5, 0.95)


class Parameter(NamedTuple):
    """A number of a site file that is fitted, such as `surfaces.soil.restitution`."""

    path: str
    low: float
    high: float


class Candidate(NamedTuple):
    """Values of the parameters, and the computed run-outs of each event [m]."""

    values: Floats
    run_outs: Mapping[str, Floats]


class Quality(NamedTuple):
    """How a prediction meets what was observed; run-outs in m."""

    score: float
    mean: float
    quantiles: tuple[float, ...]
    means: Mapping[str, float]
    stopped: float
    """Share that stops uphill of the toe of the slope [-]."""


class Fit(NamedTuple):
    """What was found."""

    site: Site
    parameters: tuple[Parameter, ...]
    best: Candidate
    low: Floats
    high: Floats
    """Ends of the 95 % interval of each parameter."""
    fitted: Quality
    validated: Quality
    """Each observed run predicted by what fits the others best."""


def parse(text: str) -> Parameter:
    """Return a parameter written as PATH or PATH=LOW:HIGH.

    Raises
    ------
    BadInput
        If it is written otherwise, or has no limits and no usual ones.
    """
    path, _, limits = text.partition("=")
    if not limits:
        usual = RANGES.get(path.rpartition(".")[2])
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


def read(path: Path, site: Site) -> dict[str, Floats]:
    """Return the observed run-outs [m], as chainages of the site, of each event.

    Raises
    ------
    BadInput
        If the file is no table with `run_out_m` and, where the site has several, `event`.
    """
    if not path.is_file():
        raise BadInput("observed", str(path), "name a CSV file with event and run_out_m")
    found: dict[str, list[float]] = {}
    with path.open(newline="", encoding="utf-8-sig") as file:
        table = csv.DictReader(file)
        names = table.fieldnames or ()
        if "run_out_m" not in names or ("event" not in names and len(site.events) > 1):
            mend = "head its columns event and run_out_m"
            raise BadInput("observed", ", ".join(names), mend)
        for i, row in enumerate(table):
            event = row.get("event") or site.events[0].name
            site.index(event)
            try:
                value = float(row["run_out_m"])
            except (TypeError, ValueError):
                value = math.nan
            last = site.slope.points[-1][0]
            check.number(f"observed row {i + 1} run_out_m", value, site.slope.points[0][0], last)
            found.setdefault(event, []).append(value)
    if sum(map(len, found.values())) < 3:
        raise BadInput("observed", str(path), "give three observed runs or more")
    return {event: np.array(values) for event, values in found.items()}


def with_values(site: Site, parameters: Sequence[Parameter], values: Sequence[float]) -> Site:
    """Return a site with other values of some numbers.

    Raises
    ------
    BadInput
        If there is no such number, or the site is not sound with the value.
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
    try:
        return msgspec.convert(tables, Site)
    except msgspec.ValidationError as error:
        if isinstance(error.__cause__, BadInput):
            raise error.__cause__ from None
        raise BadInput("--parameters", parameters[0].path, str(error)) from None


def run_outs(site: Site, model: Model, events: Sequence[str], seeds: range) -> dict[str, Floats]:
    """Return the computed run-outs of each event [m]: of a group, of its last block."""
    if model == "lumped":
        found = {event: lumped(site, (), seeds, event) for event in events}
        return {e: np.array([p.run_out[p.release == k].max() for k in range(len(seeds))])
                for e, p in found.items()}  # fmt: skip
    outcomes = release_many([(site, (), seed, event) for event in events for seed in seeds])
    each = np.array([outcome.run_out[2] for outcome in outcomes]).reshape(len(events), len(seeds))
    return dict(zip(events, each, strict=True))


def scores(computed: Floats, observed: Floats) -> Floats:
    """Return the continuous ranked probability score of each observed run [m]."""
    x = np.sort(computed)
    n = len(x)
    spread = (2.0 * np.arange(1, n + 1) - n - 1) @ x / n**2  # half of the mean distance
    return np.abs(x[None, :] - observed[:, None]).mean(axis=1) - spread


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
        The others keep the values that it has.
    observed : mapping of event to (n,) array
        See `read`.
    parameters : sequence of Parameter
        What is fitted.
    budget : int
        Most sets of values that are computed.
    releases : int
        Releases of each event with each.
    seed : int
        Of the first release, and of the search.
    tick : callable
        Told how many sets are done.
    model : {"blocks", "lumped"}
        What computes.

    Raises
    ------
    BadInput
        If a parameter is unknown, or the site unsound at a limit.
    Diverged
        If a simulation diverges.
    """
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
    compute: Callable[[Floats, range], Mapping[str, Floats]],
    budget: int,
    releases: int,
    seed: int,
    tick: Tick,
) -> Fit:
    """Fit the numbers of whatever computes run-outs to observed ones.

    Parameters
    ----------
    site : Site
        Where; the fit keeps it as it is.
    observed, parameters, budget, releases, seed, tick
        As those of `fit`.
    compute : callable
        Takes values of the parameters, (P,), and seeds; returns the run-outs of each event [m].

    Returns
    -------
    Fit
        What was found.
    """
    low, high = (np.array([getattr(p, name) for p in parameters]) for name in ("low", "high"))
    tried, table = list[Candidate](), list[Floats]()

    def attempt(place: Floats, seeds: range) -> tuple[Candidate, Floats]:
        values = low + (high - low) * np.clip(place, 0.0, 1.0)
        found = compute(values, seeds)
        each = [scores(found[event], observed[event]) for event in observed]
        return Candidate(values, found), np.concatenate(each)

    def add(place: Floats) -> float:
        candidate, each = attempt(place, range(seed, seed + releases))
        tried.append(candidate)
        table.append(each)
        tick(len(tried), f"best score {min(map(np.mean, table)):.2f} m")
        return float(each.mean())

    spread = 1 << max(2, round(math.log2(budget / 2)))
    places = qmc.Sobol(len(parameters), rng=np.random.default_rng(seed)).random(spread)
    best = places[int(np.argmin([add(place) for place in places]))]
    options = {"bounds": [0, 1], "seed": seed + 1, "verbose": -9, "maxfevals": budget - spread}
    evolution = cma.CMAEvolutionStrategy(best, 0.15, options)
    while budget - len(tried) >= evolution.popsize and not evolution.stop():
        asked = evolution.ask()
        evolution.tell(asked, [add(np.asarray(place)) for place in asked])
    fresh = range(seed + releases, seed + (1 + MORE) * releases)
    order = np.argsort([each.mean() for each in table])[:FINALISTS]
    again = [attempt((tried[i].values - low) / (high - low), fresh) for i in order]
    winner, each = min(again, key=lambda pair: float(pair[1].mean()))
    start, end = _intervals(np.array(table), np.array([c.values for c in tried]), seed)
    left_out = _validate(tried, np.array(table), observed, seed)
    toe = site.slope.toe
    whole = [winner.run_outs[event] for event in observed for _ in observed[event]]
    return Fit(
        site,
        tuple(parameters),
        winner,
        np.minimum(start, winner.values),
        np.maximum(end, winner.values),
        quality(observed, whole, float(each.mean()), toe),
        quality(observed, *left_out, toe),
    )


def quality(
    observed: Mapping[str, Floats], predicted: Sequence[Floats], score: float, toe: float
) -> Quality:
    """Return the figures of a prediction: the computed run-outs for each observed run."""
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
    """Return the figures of what was observed."""
    every = np.concatenate(list(observed.values()))
    quantiles = tuple(float(q) for q in np.quantile(every, QUANTILES))
    means = {event: float(values.mean()) for event, values in observed.items()}
    return Quality(0.0, float(every.mean()), quantiles, means, float((every < toe).mean()))


def _intervals(table: Floats, values: Floats, seed: int) -> tuple[Floats, Floats]:
    """Return the 95 % interval of each parameter, by resampling the observed runs."""
    rng = np.random.default_rng([seed, 1])
    runs = rng.integers(table.shape[1], size=(RESAMPLES, table.shape[1]))
    best = np.array([table[:, chosen].mean(axis=1).argmin() for chosen in runs])
    low, high = np.quantile(values[best], (0.025, 0.975), axis=0)
    return low, high


def _validate(
    tried: Sequence[Candidate], table: Floats, observed: Mapping[str, Floats], seed: int
) -> tuple[list[Floats], float]:
    """Return the run-outs that predict each observed run, left out of the fit, and their score."""
    events = [event for event in observed for _ in observed[event]]
    count = table.shape[1]
    parts = np.random.default_rng([seed, 2]).permutation(count) % min(FOLDS, count)
    predicted: list[Floats] = [np.zeros(0)] * count
    score = 0.0
    for part in range(min(FOLDS, count)):
        out = np.flatnonzero(parts == part)
        best = int(np.delete(table, out, axis=1).mean(axis=1).argmin())
        score += float(table[best, out].sum())
        for i in out:
            predicted[i] = tried[best].run_outs[events[i]]
    return predicted, score / count


def rows(fitted: Fit, observed: Mapping[str, Floats]) -> list[dict[str, Any]]:
    """Return the parameters and what they give beside what was observed, a row each."""
    ends = (fitted.parameters, fitted.best.values, fitted.low, fitted.high)
    out: list[dict[str, Any]] = [
        {
            "what": p.path,
            "unit": "",
            "fitted": v,
            "low": a,
            "high": b,
            "observed": "",
            "left_out": "",
        }
        for p, v, a, b in zip(*ends, strict=True)
    ]
    own, left, real = fitted.fitted, fitted.validated, seen(observed, fitted.site.slope.toe)

    def add(what: str, unit: str, pick: Callable[[Quality], float]) -> None:
        row = {"what": what, "unit": unit, "fitted": pick(own), "low": "", "high": ""}
        out.append(row | {"observed": pick(real), "left_out": pick(left)})

    add("score", "m", lambda q: q.score)
    add("mean run-out", "m", lambda q: q.mean)
    for k, share in enumerate(QUANTILES):
        add(f"{share:.0%} of run-outs", "m", lambda q, k=k: q.quantiles[k])  # type: ignore[misc]
    for event in observed:
        add(f"mean run-out, {event}", "m", lambda q, e=event: q.means[e])  # type: ignore[misc]
    add("stops on the slope", "-", lambda q: q.stopped)
    return out


def write(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write `rows` as CSV."""
    write_rows(path, rows(fitted, observed))


def draw(path: Path, fitted: Fit, observed: Mapping[str, Floats]) -> None:
    """Write a PNG: cumulative run-out observed and computed, all runs and each event."""
    from matplotlib.figure import Figure

    from agents.pictures import save

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
        axes.plot(grid, share, color="#1c5aa0", label="computed, 95 % of samples as small")
        axes.step(np.sort(real), np.arange(1, len(real) + 1) / len(real), where="post",
                  color="#c0392b", label=f"observed, {len(real)}")  # fmt: skip
        axes.set(xlabel="run-out [m]", title=name, ylim=(0, 1))
    figure.axes[0].set_ylabel("share of runs")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="upper left")
    save(figure, path)
