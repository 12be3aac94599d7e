"""Fit a site to run-outs that were observed there: which numbers of its file explain them best.

Computed run-outs are a sample of what the site may do, an observed one is a single draw of what it
did. The two are compared by the continuous ranked probability score (Gneiting and Raftery 2007),
the mean distance of observed from computed ones less half of their own mean distance [m]. It is
least in expectation for the distribution that the observed run-outs came from.

About half of the budget, a power of two, is spread over the box of parameters (Sobol), the rest
follows CMA-ES from the best of them; all releases have the same seeds. The best ones are computed
again on fresh seeds, to choose without luck. Intervals and the cross-validation choose among all
that were computed, by resampled or left-out observed runs. CMA-ES was led by all runs, so that the
validation is a little too good; what it chooses is computed again on fresh seeds, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Site
from rigdda.agents.fit_trials import Candidate, Compute, Trials, explore
from rigdda.agents.parameters import Parameter, check_parameters, with_values
from rigdda.agents.prediction import Quality, quality
from rigdda.agents.run_outs import Model, run_outs

Floats = NDArray[np.float64]
Tick = Callable[[int, str], None]

FINALISTS, MORE = 8, 4
"""How many of the best are computed again, on how many times the releases."""

FOLDS = 11
"""Parts of the observed runs that are left out in turn."""

RESAMPLES = 1000
"""Of the observed runs, for intervals."""


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
    left_out: Floats
    """Score of each observed run by that, (runs,) [m]."""


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
        See `run_outs.read`.
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
        If a parameter is unknown, comes twice or has no influence on the run-outs of the model, or
        the site is unsound at a limit.
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
    """Return the 95 % interval of each parameter, by resampling the observed runs.

    All that was tried, where the runs tell nothing.
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
    """Return the run-outs that predict each observed run, left out of the fit, and its score.

    By the set of values that fits the others best, computed on fresh seeds.
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
