"""Fit of numbers in a site file to observed run-outs, deposits and passages.

The score of a set of numbers is the mean continuous ranked probability score of the observed
values: the distance of each value from the computed distribution. Observations of other quantities
than chainages are divided by their standard deviation first. A deposit counts as many values as it
has independent blocks, see `independent_blocks`.

The posterior is a bootstrap: for each of many samples of the observed values, drawn with
replacement, the numbers with the best score are sought on a Gaussian process through the scores of
all sets that were tried. New noise is added to the scores of each sample, with the standard
deviation that the process estimates. Without smoothing, a set with favourable releases would be
chosen too often.
"""

from __future__ import annotations

import hashlib
import math
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import cma
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

import rigdda
from rigdda import MECHANICS, BadInput, Site, release_many
from rigdda.app.reports.stations import QUANTITIES
from rigdda.app.reports.tables import write_rows
from rigdda.app.uncertainty.observations import (
    DEPOSIT,
    LEAST_VALUES,
    OBSERVED_RUN_OUT,
    DataSet,
    DataSets,
)
from rigdda.app.uncertainty.parameters import Parameter, Posterior, check_once, with_values
from rigdda.app.uncertainty.score_surface import best_places
from rigdda.envs.outcome_cache import fingerprint
from rigdda.files import UNFINISHED, atomic
from rigdda.lumped_mass import lumped
from rigdda.passages import Passages, passages
from rigdda.rounding import chainage

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FITTED_TABLES = {"blocks": ("surfaces", "motion", "scatter"), "lumped": ("lumped", "scatter")}
"""Tables of a site file that affect the run-outs of a model."""


def check_parameters(parameters: Sequence[Parameter], model: str) -> None:
    """Check that the run-outs of a model depend on the parameters and that each is named once.

    Raises
    ------
    BadInput
        If a parameter is repeated or if the run-outs do not depend on it.
    """
    check_once(parameters)
    for parameter in parameters:
        if parameter.path.partition(".")[0] not in FITTED_TABLES[model]:
            known = ", ".join(f"{name}.*" for name in FITTED_TABLES[model])
            hint = f"run-outs of the model {model} do not depend on it: choose from {known}"
            raise BadInput("--parameters", parameter.path, hint)


def check_quantities(sets: DataSets, model: str) -> None:
    """Check that a model computes the observed quantities.

    Raises
    ------
    BadInput
        If the model is "lumped" and there are other observations than run-outs.
    """
    if model == "lumped" and any(one.quantity != OBSERVED_RUN_OUT for one in sets.values()):
        raise BadInput("--model", model, "use blocks: points give run-outs only")


Floats = NDArray[np.float64]
Model = Literal["blocks", "lumped"]


def run_outs(site: Site, model: Model, events: Sequence[str], seeds: range) -> dict[str, Floats]:
    """Return the computed run-outs of each event [m]; of a group, that of the farthest block."""
    if model == "lumped":
        found = {event: lumped(site, (), seeds, event) for event in events}
        return {e: np.array([p.run_out[p.release == k].max() for k in range(len(seeds))])
                for e, p in found.items()}  # fmt: skip
    outcomes = release_many([(site, (), seed, event) for event in events for seed in seeds])
    each = np.array([outcome.run_out[2] for outcome in outcomes]).reshape(len(events), len(seeds))
    return dict(zip(events, each, strict=True))


def computed(site: Site, sets: DataSets, model: Model, seeds: range) -> dict[str, Floats]:
    """Return the computed values of each set of observations, by name.

    Raises
    ------
    BadInput
        If the model is "lumped" and there are other observations than run-outs.
    Diverged
        If a simulation diverges.
    """
    check_quantities(sets, model)
    runs = [one.event for one in sets.values() if one.quantity == OBSERVED_RUN_OUT]
    out = run_outs(site, model, runs, seeds)
    others = [one for one in sets.values() if one.quantity != OBSERVED_RUN_OUT]
    if not others:
        return out
    stations = sorted({one.station for one in others if one.passes})
    events = list(dict.fromkeys(one.event for one in others))
    asked = [(seed, event) for event in events for seed in seeds]
    found = passages(site, (), asked, stations)
    return out | {one.name: _values(site, found, one) for one in others}


DEPOSIT_PIECES = 400
"""Number of equally heavy pieces into which the rock of a computed deposit is divided."""


def _values(site: Site, found: Passages, one: DataSet) -> Floats:
    """Return the computed values of a deposit or a passage.

    If no block passes a station, the only value is 0. If no rock stops within a deposit, it is
    taken to lie one length of the deposit uphill of it.
    """
    number = site.event_names.index(one.event)
    if one.passes:
        rows = found.at(int(np.searchsorted(found.stations, one.station)))
        values = QUANTITIES[one.quantity].of(rows[rows["event"] == number])
        return values if len(values) else np.zeros(1)
    stops = found.stops[found.stops["event"] == number]
    low, high = one.values[0], one.values[-1]
    here = np.sort(stops[(stops["x"] >= low) & (stops["x"] <= high)], order="x")
    if not len(here):
        return np.array([low - (high - low)])
    share = np.cumsum(here["mass"])
    place = (np.arange(DEPOSIT_PIECES) + 0.5) / DEPOSIT_PIECES * share[-1]
    return np.asarray(here["x"][np.searchsorted(share, place)], dtype=np.float64)


ALIKE = 1e-20
"""Variance between releases of the share of rock above the ends of intervals that is due to
rounding [-]; releases with a smaller one are alike."""


def independent_blocks(site: Site, one: DataSet, seeds: range) -> int:
    """Return the number of independent blocks with as much information as a deposit.

    Blocks of one release push one another and start together, and large blocks count more than
    small ones. The number follows from the variance between computed releases of the share of rock
    above each end of an interval, compared with that of equal independent blocks. It is multiplied
    by the number of releases that made the deposit.

    Raises
    ------
    BadInput
        If there are fewer than three; or if the number does not follow from the computed releases,
        because no rock stops within the deposit, all of it stops in one interval, or the releases
        are alike.
    Diverged
        If a simulation diverges.
    """
    crossed = passages(site, (), [(seed, one.event) for seed in seeds], ())
    low, high = one.values[0], one.values[-1]
    stops = crossed.stops[(crossed.stops["x"] >= low) & (crossed.stops["x"] <= high)]
    mass = np.zeros(len(crossed.seed))
    np.add.at(mass, stops["release"], stops["mass"])
    above = np.zeros((len(mass), len(one.values) - 2))
    for j, end in enumerate(one.values[1:-1]):
        below = stops[stops["x"] <= end]
        np.add.at(above[:, j], below["release"], below["mass"])
    _check_stops(one, stops["x"], len(mass))
    share = above.sum(axis=0) / float(mass.sum())
    alone = float((share * (1.0 - share)).sum())
    each = (above - share * mass[:, None]) / float(mass.mean())
    between = float(np.square(each).mean(axis=0).sum())
    if between < ALIKE:
        hint = f"{len(mass)} computed releases are alike, so that their blocks are not distributed "
        hint += "at random: let releases differ, for example by a disturbance of the source"
        raise BadInput(f"observed deposit of {one.event}", one.name, hint)
    count = round(alone / between * one.releases)
    if count < LEAST_VALUES:
        hint = (
            f"a deposit of {one.releases} releases has as little information as {count} blocks, "
            f"but a fit needs {LEAST_VALUES}: give a deposit of more releases, and give their "
            "number in the column releases"
        )
        raise BadInput(f"observed deposit of {one.event}", count, hint)
    return min(count, DEPOSIT_PIECES)


def _check_stops(one: DataSet, stops: Floats, releases: int) -> None:
    """Check that rock of computed releases stops in more than one interval of a deposit.

    Parameters
    ----------
    one : DataSet
        The deposit.
    stops : (N,) array
        Chainages within the deposit at which blocks of the computed releases stop [m].
    releases : int
        Number of computed releases.

    Raises
    ------
    BadInput
        If no block stops within the deposit, or if all blocks stop in the same interval.
    """
    ends, where = one.values, f"observed deposit of {one.event}"
    ground = (
        "or change the ground (a fit computes these releases with its numbers in the middle of "
        "their limits LOW:HIGH)"
    )
    held = np.unique(np.searchsorted(ends[1:-1], stops))
    if not len(held):
        span = f"{chainage(ends[0])} to {chainage(ends[-1])} m"
        hint = f"no rock of {releases} computed releases stops there: correct the event or the "
        raise BadInput(where, span, f"{hint}chainages, {ground}")
    if len(held) == 1:
        span = f"{chainage(ends[held[0]])} to {chainage(ends[held[0] + 1])} m"
        hint = f"all rock of {releases} computed releases that stops within the deposit stops in "
        raise BadInput(where, span, f"{hint}this interval: divide it, {ground}")


def observed_values(site: Site, sets: DataSets, seeds: range) -> dict[str, Floats]:
    """Return the observed values of each set, by name; of a deposit, those of independent blocks.

    Raises
    ------
    BadInput, Diverged
        As `independent_blocks` does.
    """
    return {
        name: one.sample(independent_blocks(site, one, seeds))
        if one.quantity == DEPOSIT
        else one.values
        for name, one in sets.items()
    }


def units(sets: DataSets) -> dict[str, float]:
    """Return the amounts by which the scores of each set are divided.

    They are 1 m if all are chainages, and otherwise the standard deviations of the observations.
    """
    if not any(one.passes for one in sets.values()):
        return dict.fromkeys(sets, 1.0)
    found = {}
    for name, one in sets.items():
        values = one.sample(DEPOSIT_PIECES) if one.quantity == DEPOSIT else one.values
        spread = float(values.std()) or float(np.abs(values).mean())
        found[name] = spread or 1.0
    return found


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
    found = np.quantile(every, QUANTILES, method="inverted_cdf")  # as in `quality`
    quantiles = tuple(float(q) for q in found)
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
    observed, parameters, compute, scale
        See `search`.

    Attributes
    ----------
    tried : list of Candidate
        The parameter sets in the order in which they were computed.
    places : list of (P,) array
        Their points in the unit cube.
    table : list of (runs,) array
        Scores of the observed runs for each parameter set [m].
    """

    def __init__(
        self,
        observed: Mapping[str, Floats],
        parameters: Sequence[Parameter],
        compute: Compute,
        scale: Mapping[str, float],
    ):
        self._observed, self._compute, self._scale = observed, compute, scale
        self._low = np.array([p.low for p in parameters])
        self._range = np.array([p.high for p in parameters]) - self._low
        self.tried: list[Candidate] = []
        self.places: list[Floats] = []
        self.table: list[Floats] = []

    def values(self, place: Floats) -> Floats:
        """Return the values of the parameters at a point of the unit cube, (P,)."""
        return self._low + self._range * np.clip(place, 0.0, 1.0)

    def compute(self, values: Floats, seeds: range) -> tuple[Candidate, Floats]:
        """Compute the run-outs for a parameter set and the scores of the observed runs."""
        found = self._compute(values, seeds)
        each = [
            scores(found[name], self._observed[name]) / self._scale.get(name, 1.0)
            for name in self._observed
        ]
        return Candidate(values, found), np.concatenate(each)

    def add(self, place: Floats, seeds: range) -> float:
        """Try a point of the unit cube and return its mean score [m]."""
        candidate, each = self.compute(self.values(place), seeds)
        self.tried.append(candidate)
        self.places.append(np.clip(place, 0.0, 1.0))
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
    if dimensions == 1:  # cma limits the standard deviation to a third, which fails for one number
        options["maxstd_boundrange"] = math.inf
    evolution = cma.CMAEvolutionStrategy(best, 0.15, options)
    done = spread
    while budget - done >= evolution.popsize and not evolution.stop():
        asked = evolution.ask()
        evolution.tell(asked, [score(np.asarray(place)) for place in asked])
        done += len(asked)


Tick = Callable[[int, str], None]

FINALISTS, FINALIST_FACTOR = 8, 4
"""Number of the best candidates that are computed again, and the factor by which their number of
releases is larger."""

FOLDS = 11
"""Number of folds of the cross-validation."""

RESAMPLES = 1000
"""Number of bootstrap samples of the observed values for the posterior."""


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
    posterior: Posterior
    """Samples of the parameters; their 95 % interval is from `low` to `high`."""
    observed: Mapping[str, Floats]
    """Observed values by set."""
    sets: DataSets
    """The sets of observations; empty if all values are run-outs of events."""

    @property
    def pooled(self) -> bool:
        """Whether all observations are run-outs, so that they have statistics in common."""
        return all(one.quantity == OBSERVED_RUN_OUT for one in self.sets.values())


def values_to_fit(
    site: Site,
    sets: DataSets,
    parameters: Sequence[Parameter],
    releases: int,
    seed: int,
    model: Model = "blocks",
) -> dict[str, Floats]:
    """Check the arguments of a fit and return the observed values of each set, by name.

    Parameters
    ----------
    site, sets, parameters, releases, seed, model
        See `fit`.

    Raises
    ------
    BadInput
        If a parameter is unknown, is repeated or has no influence on the run-outs of the model, if
        the site is invalid at a limit, if the model cannot compute an observed quantity, or as
        `independent_blocks` does.
    Diverged
        If a simulation diverges.
    """
    check_parameters(parameters, model)
    check_quantities(sets, model)
    low, high = (np.array([getattr(p, name) for p in parameters]) for name in ("low", "high"))
    with_values(site, parameters, list(low)), with_values(site, parameters, list(high))
    middle = with_values(site, parameters, list(0.5 * (low + high)))
    return observed_values(middle, sets, range(seed, seed + releases))


def fit(
    site: Site,
    sets: DataSets,
    parameters: Sequence[Parameter],
    budget: int,
    releases: int,
    seed: int,
    tick: Tick,
    model: Model = "blocks",
    out: Path | None = None,
    observed: Mapping[str, Floats] | None = None,
) -> Fit:
    """Fit parameters of a site to observations.

    Parameters
    ----------
    site : Site
        The site, which provides the values of all other numbers.
    sets : mapping of str to DataSet
        The observations, see `rigdda.app.uncertainty.observations.read`.
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
        Model that computes the values; "lumped" computes run-outs only.
    out : path, optional
        Folder in which computed values are kept until `rigdda.files.remove_unfinished`, so that a
        fit that was killed continues from there.
    observed : mapping of str to (n,) array, optional
        What `values_to_fit` returns for the same arguments, if this is known already.

    Raises
    ------
    BadInput
        As `values_to_fit` does.
    Diverged
        If a simulation diverges.
    """
    if observed is None:
        observed = values_to_fit(site, sets, parameters, releases, seed, model)

    def compute(values: Floats, seeds: range) -> Mapping[str, Floats]:
        changed = with_values(site, parameters, list(values))
        file = (
            None if out is None else out / UNFINISHED / f"{_key(changed, sets, model, seeds)}.npz"
        )
        known = None if file is None else _read(file, sets)
        if known is None:
            known = computed(changed, sets, model, seeds)
            if file is not None:
                with atomic(file) as part, part.open("wb") as opened:
                    arrays: dict[str, Any] = {c: known[n] for n, c in _columns(sets).items()}
                    np.savez(opened, **arrays)
        return known

    found = search(site, observed, parameters, compute, budget, releases, seed, tick, units(sets))
    best = with_values(site, parameters, list(found.best.values))
    return found._replace(site=best, sets=sets)


def _columns(sets: DataSets) -> dict[str, str]:
    """Return a name without special characters for each set of observations, by its name."""
    return {name: f"observations_{i}" for i, name in enumerate(sets)}


def _key(site: Site, sets: DataSets, model: Model, seeds: range) -> str:
    """Return a hash of everything that computed values depend on."""
    key = fingerprint(site).hex()
    asked: list[Any] = [rigdda.__version__, MECHANICS, key, model, seeds.start, seeds.stop]
    asked += [[one.name, one.values[[0, -1]].tolist()] for one in sets.values()]
    return hashlib.sha256(msgspec.json.encode(asked)).hexdigest()[:24]


def _read(file: Path, sets: DataSets) -> dict[str, Floats] | None:
    """Return the computed values in a file, None if there is none or it is damaged."""
    try:
        with np.load(file) as stored:
            return {name: stored[column] for name, column in _columns(sets).items()}
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
        return None


def search(
    site: Site,
    observed: Mapping[str, Floats],
    parameters: Sequence[Parameter],
    compute: Compute,
    budget: int,
    releases: int,
    seed: int,
    tick: Tick,
    scale: Mapping[str, float] | None = None,
) -> Fit:
    """Fit the parameters of any model to observations.

    Parameters
    ----------
    site : Site
        The site, which the fit does not change.
    observed : mapping of str to (n,) array
        Observed values of each set, for example the run-outs of an event [m].
    parameters, budget, releases, seed, tick
        See `fit`.
    compute : callable
        Function of the values of the parameters, (P,), and of seeds that returns the computed
        values of each set.
    scale : mapping of str to float, optional
        Amounts by which the scores of the sets are divided, by default 1.

    Returns
    -------
    Fit
        Result of the fit.
    """
    trials = Trials(observed, parameters, compute, scale or {})
    seeds = range(seed, seed + releases)

    def add(place: Floats) -> float:
        score = trials.add(place, seeds)
        tick(len(trials.tried), f"best score {min(map(np.mean, trials.table)):.3g}")
        return score

    explore(add, len(parameters), budget, seed)
    fresh = range(seed + releases, seed + (1 + FINALIST_FACTOR) * releases)
    again = [trials.compute(candidate.values, fresh) for candidate in trials.best(FINALISTS)]
    winner, each = min(again, key=lambda pair: float(pair[1].mean()))
    posterior = _posterior(parameters, trials, seed)
    low, high = posterior.interval(0.95)
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
        posterior,
        dict(observed),
        {},
    )


def _posterior(parameters: Sequence[Parameter], trials: Trials, seed: int) -> Posterior:
    """Return the posterior of the parameters by bootstrap of the observed values.

    If all parameter sets have the same scores, the observations tell nothing, and the posterior is
    spread evenly over the ranges of the parameters.
    """
    paths, table = [parameter.path for parameter in parameters], np.array(trials.table)
    rng = np.random.default_rng([seed, 1])
    if (table == table[0]).all():
        spread = qmc.LatinHypercube(len(paths), rng=rng).random(RESAMPLES)
        every = np.array([trials.values(place) for place in spread])
        return Posterior.of(paths, every, np.ones(RESAMPLES))
    count = table.shape[1]
    drawn = rng.multinomial(count, np.full(count, 1.0 / count), size=RESAMPLES) / count
    places = best_places(np.array(trials.places), table @ drawn.T, rng)
    values, number = np.unique([trials.values(at) for at in places], axis=0, return_counts=True)
    return Posterior.of(paths, values, number.astype(np.float64))


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
    if not fitted.pooled:
        return [*out, *_by_set(fitted)]

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


def _by_set(fitted: Fit) -> list[dict[str, Any]]:
    """Return rows with the score and with the mean and the 95 % quantile of each set."""
    blank = {"low": "", "high": "", "identified": ""}
    own, left = fitted.fitted, fitted.validated
    mixed = any(one.passes for one in fitted.sets.values())
    head = {"what": "score", "unit": "-" if mixed else "m", "fitted": own.score} | blank
    out: list[dict[str, Any]] = [head | {"observed": 0.0, "left_out": left.score}]
    for name, one in fitted.sets.items():
        real, made = _shown(fitted, name), fitted.best.run_outs[name]
        row = {"what": f"mean, {name}", "unit": one.unit, "fitted": float(made.mean())} | blank
        out.append(row | {"observed": float(real.mean()), "left_out": left.means[name]})
        ends = (float(np.quantile(values, 0.95)) for values in (made, real))
        row = {"what": f"95 %, {name}", "unit": one.unit, "fitted": next(ends)} | blank
        out.append(row | {"observed": next(ends), "left_out": ""})
    return out


def _shown(fitted: Fit, name: str) -> Floats:
    """Return the observed values of a set; of a deposit, those of equally heavy pieces of it."""
    one = fitted.sets.get(name)
    if one is None or one.quantity != DEPOSIT:
        return fitted.observed[name]
    return one.sample(DEPOSIT_PIECES)


def write(path: Path, fitted: Fit) -> None:
    """Write the rows of a fit as a CSV file."""
    write_rows(path, rows(fitted, fitted.observed))


def draw(path: Path, fitted: Fit) -> None:
    """Write a PNG of the cumulative distributions of observed and computed values."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from rigdda.app.reports.pictures import FONT, save

    observed = fitted.observed
    names = ["all", *observed] if len(observed) > 1 and fitted.pooled else list(observed)
    with rc_context(FONT):
        figure = Figure(figsize=(3.2 * len(names) + 0.6, 3.6), layout="constrained")
        for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
            own = list(observed) if name == "all" else [name]
            _draw_distributions(axes, fitted, own)
            deposits = [e for e in own if e in fitted.sets and fitted.sets[e].quantity == DEPOSIT]
            count = sum(len(observed[e]) for e in own)
            words = f"as {count} blocks" if deposits else f"{count} observed"
            axes.set_title(f"{name}\n{words}", fontsize=10)
            axes.set(xlabel=_axis(fitted, own[0]), ylim=(0, 1))
        figure.axes[0].set_ylabel("share of blocks")
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower center",
                      fontsize=8, frameon=False)  # fmt: skip
        save(figure, path)


GRID_POINTS, GRID_MARGIN = 400, 0.05
"""Number of places at which a computed distribution is drawn, and length of the axis beyond the
least and the greatest value, divided by the range of the values [-]."""


def _draw_distributions(axes: Axes, fitted: Fit, own: Sequence[str]) -> None:
    """Draw the cumulative distributions of the observed and computed values of some sets."""
    count = sum(len(fitted.observed[e]) for e in own)
    real = np.concatenate([_shown(fitted, e) for e in own])
    grid = _grid(np.concatenate([real, *(fitted.best.run_outs[e] for e in own)]))
    share = np.zeros(len(grid))
    for e in own:
        below = (fitted.best.run_outs[e][:, None] <= grid).mean(axis=0)
        share += len(fitted.observed[e]) / count * below
    half = 1.96 * np.sqrt(share * (1.0 - share) / count)
    axes.fill_between(grid, np.clip(share - half, 0, 1), np.clip(share + half, 0, 1),
                      color="#1c5aa0", alpha=0.2, lw=0)  # fmt: skip
    axes.plot(grid, share, color="#1c5aa0", label="computed, 95 % band of samples of this size")
    axes.ecdf(real, color="#c0392b", label="observed")
    axes.set_xlim(grid[0], grid[-1])


def _grid(values: Floats) -> Floats:
    """Return places at which a distribution of some values is drawn, from below to above them."""
    low, high = float(values.min()), float(values.max())
    margin = GRID_MARGIN * (high - low) or GRID_MARGIN * abs(high) or 1.0
    return np.linspace(low - margin, high + margin, GRID_POINTS)


def _axis(fitted: Fit, name: str) -> str:
    """Return the quantity and the unit of a set of observations."""
    one = fitted.sets.get(name)
    if one is None or not one.passes:
        return "run-out [m]"
    return f"{QUANTITIES[one.quantity].words} [{one.unit}]"
