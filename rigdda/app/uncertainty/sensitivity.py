"""Sensitivity analysis: which uncertain numbers of a site the results depend on.

`analyse` computes the indices of any function on the unit cube with SALib. `run` applies it to a
site with a layout.

The method of Morris (1991) changes one input at a time along random trajectories. Its index mu* is
the mean absolute change of the output, extrapolated to the whole range of the input; sigma is the
standard deviation of this change, which is large if the input interacts with others. The
first-order index S1 of Sobol' is the share of the variance of the output that an input explains
alone, and the total index ST is its share including all interactions.

The output of a simulation is a mean over releases and therefore noisy. The variance of this noise
in each change follows from the differences of single releases, which have the same seeds.
`AnalysedInput.noise` is the part of an index that the noise alone would cause on average, and
`AnalysedInput.signal` is the ratio of the changes to their noise.

Sources: Morris, Factorial sampling plans for preliminary computational experiments, Technometrics
33 (1991) 161-174; Campolongo, Cariboni and Saltelli, An effective screening design for sensitivity
analysis of large models, Environmental Modelling & Software 22 (2007) 1509-1518; Saltelli et al.,
Variance based sensitivity analysis of model output, Computer Physics Communications 181 (2010)
259-270; Herman and Usher, SALib, Journal of Open Source Software 2 (2017) 97.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, Site, check
from rigdda.agents.limits import JOB_RELEASES
from rigdda.app.uncertainty.parameters import Input, Parameter, site_at
from rigdda.app.uncertainty.varied_sites import (
    Priced,
    Seeds,
    noise,
    price,
    simulate,
)
from rigdda.envs import DesignProblem
from rigdda.envs.intervals import CONFIDENCE
from rigdda.envs.outcome_cache import release_key

Floats = NDArray[np.float64]
Method = Literal["morris", "sobol"]
Tick = Callable[[int, str], None]

Pairs = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Indices of the points at the start and the end of each change of one input."""

METHODS = ("morris", "sobol")

SAMPLES = {"morris": 20, "sobol": 64}
"""Default number of trajectories, and of points from which the indices of Sobol' are computed."""

MORRIS_LEVELS = 4
"""Levels of each input in the method of Morris."""

RESAMPLES = 500
"""Number of bootstrap samples for the intervals."""

CHANGE_ROUNDING = 1e-12
"""Changes smaller than this share of the largest value count as 0 [-]."""

DISTINCT = 2.24
"""Ratio of changes to noise above which they count as distinguishable [-]. The absolute value of a
standard normal number exceeds it in 2.5 % of cases, and there are two such ratios. It is also safe
if the noise is the same in all changes because their releases are."""


class Response(NamedTuple):
    """Values of an output at n points.

    Parameters
    ----------
    values : (n,) array
        The values.
    terms : (n, R) array
        The contributions of R releases to each value; (n, 0) if the values are exact.
    strata : (R,) array
        Event of each release.
    """

    values: Floats
    terms: Floats
    strata: NDArray[np.int64]

    @classmethod
    def exact(cls, values: Floats) -> Response:
        """Return values without noise."""
        array = np.asarray(values, dtype=np.float64)
        return cls(array, np.zeros((len(array), 0)), np.zeros(0, dtype=np.int64))

    def noise(self, first: NDArray[np.int64], second: NDArray[np.int64]) -> Floats:
        """Return the variance of the noise in the differences between pairs of points."""
        return noise(self.terms[second] - self.terms[first], self.strata)

    @property
    def error(self) -> Floats:
        """Standard error of each value, (n,)."""
        return np.sqrt(noise(self.terms, self.strata))


@dataclass(frozen=True, slots=True)
class AnalysedInput:
    """Indices of one input.

    Parameters
    ----------
    index, low, high : float
        mu* in the unit of the output, or the total index ST [-], and its 95 % bootstrap interval.
    first, first_low, first_high : float
        The signed mean change mu and its interval, or the first-order index S1 and its interval.
    spread : float
        sigma of the method of Morris in the unit of the output, NaN for Sobol'.
    change : float
        Average change of the output from the low to the high end of the range of the input.
    noise : float
        Value that `index` would have on average if the changes were nothing but noise.
    signal : float
        Ratio of the changes of the output to their noise [-]: of the root mean squares, or of the
        average change to its standard error, if this is larger. It is infinite without noise.
    """

    index: float
    low: float
    high: float
    first: float
    first_low: float
    first_high: float
    spread: float
    change: float
    noise: float
    signal: float

    @property
    def distinguishable(self) -> bool:
        """Whether the changes are larger than noise alone would cause, with 95 % confidence."""
        return self.index > 0.0 and self.signal > DISTINCT


def places(method: Method, dimensions: int, samples: int, seed: int) -> Floats:
    """Return the points at which an output is needed, (n, D) in the unit cube.

    n is samples (D + 1) for the method of Morris and samples (D + 2) for that of Sobol'.

    Raises
    ------
    BadInput
        If there is no such method, or the number of samples is not a power of two for Sobol'.
    """
    check.one_of("--method", method, METHODS)
    count = check.integer("--samples", samples, 2, JOB_RELEASES)
    problem = _problem(dimensions)
    if method == "morris":
        from SALib.sample import morris

        return np.asarray(
            morris.sample(problem, count, MORRIS_LEVELS, seed=seed + 1), dtype=np.float64
        )
    if count & (count - 1):
        near = 1 << round(math.log2(count))
        raise BadInput("--samples", count, f"give a power of two for sobol, such as {near}")
    from SALib.sample import sobol

    found = sobol.sample(problem, count, calc_second_order=False, seed=seed + 1)
    return np.asarray(found, dtype=np.float64)


def _problem(dimensions: int) -> dict[str, Any]:
    """Return the description of the unit cube for SALib."""
    names = [f"x{i}" for i in range(dimensions)]
    return {"num_vars": dimensions, "names": names, "bounds": [[0.0, 1.0]] * dimensions}


def analyse(method: Method, cube: Floats, response: Response, seed: int) -> list[AnalysedInput]:
    """Return the indices of each input.

    Parameters
    ----------
    method : {"morris", "sobol"}
        The method.
    cube : (n, D) array
        The points, see `places`.
    response : Response
        The output at these points.
    seed : int
        Seed of the bootstrap.
    """
    dimensions = cube.shape[1]
    pairs = [_pairs(method, cube, i) for i in range(dimensions)]
    changes = [_change(cube[:, i], response.values, *pair) for i, pair in enumerate(pairs)]
    noisy = [response.noise(*pair) for pair in pairs]
    if np.ptp(response.values) <= CHANGE_ROUNDING * np.abs(response.values).max():
        return [AnalysedInput(*[0.0] * 10) for _ in pairs]
    signals = [
        _signal(cube[:, i], response, pair, own)
        for i, (pair, own) in enumerate(zip(pairs, noisy, strict=True))
    ]
    each = _morris if method == "morris" else _sobol
    return each(cube, response.values, list(zip(changes, noisy, signals, strict=True)), seed)


Pair = tuple[float, Floats, float]
"""Average change of the output due to an input, variance of the noise of each, and the ratio of
changes to noise."""


def _signal(place: Floats, response: Response, pair: Pairs, variance: Floats) -> float:
    """Return the larger one of two ratios of the changes due to an input to their noise.

    One is that of the root mean squares of the changes, the other is the average change, divided by
    its standard error.
    """
    first, second = pair
    changes = response.values[second] - response.values[first]
    signal, noisy = float(np.square(changes).sum()), float(variance.sum())
    if noisy <= 0.0:
        return math.inf if signal > 0.0 else 0.0
    moved = place[second] - place[first]
    mean = moved @ (response.terms[second] - response.terms[first])
    error = float(np.sqrt(noise(mean[None], response.strata))[0])
    average = abs(float(moved @ changes)) / error if error > 0.0 else 0.0
    return max(math.sqrt(signal / noisy), average)


def _morris(cube: Floats, values: Floats, pairs: Sequence[Pair], seed: int) -> list[AnalysedInput]:
    """Return the indices of Morris."""
    from SALib.analyze import morris

    found = morris.analyze(
        _problem(cube.shape[1]), cube, values, num_levels=MORRIS_LEVELS, num_resamples=RESAMPLES,
        conf_level=CONFIDENCE, seed=seed + 1,
    )  # fmt: skip
    step = MORRIS_LEVELS / (2.0 * (MORRIS_LEVELS - 1.0))
    count = len(values) // (cube.shape[1] + 1)
    out = []
    for i, (change, variance, signal) in enumerate(pairs):
        star, half = float(found["mu_star"][i]), float(np.nan_to_num(found["mu_star_conf"][i]))
        mean, spread = float(found["mu"][i]), float(np.nan_to_num(found["sigma"][i]))
        wide = 1.96 * spread / math.sqrt(count)
        floor = math.sqrt(2.0 / math.pi) * float(np.sqrt(variance).mean()) / step
        ends = star - half, star + half, mean, mean - wide, mean + wide
        out.append(AnalysedInput(star, *ends, spread, change, floor, signal))
    return out


def _sobol(cube: Floats, values: Floats, pairs: Sequence[Pair], seed: int) -> list[AnalysedInput]:
    """Return the indices of Sobol'."""
    from SALib.analyze import sobol

    dimensions = cube.shape[1]
    with warnings.catch_warnings():
        # resamples of an output that seldom changes may be constant; their indices are 0
        warnings.simplefilter("ignore", UserWarning)
        found = sobol.analyze(
            _problem(dimensions), values, calc_second_order=False, num_resamples=RESAMPLES,
            conf_level=CONFIDENCE, seed=seed + 1,
        )  # fmt: skip
    spread = np.var([values[:: dimensions + 2], values[dimensions + 1 :: dimensions + 2]])
    out = []
    for i, (change, variance, signal) in enumerate(pairs):
        one, total, half, wide = (
            float(np.nan_to_num(found[name][i])) for name in ("S1", "ST", "S1_conf", "ST_conf")
        )
        floor = float(variance.mean() / (2.0 * spread)) if spread > 0.0 else 0.0
        ends = total - wide, total + wide, one, one - half, one + half
        out.append(AnalysedInput(total, *ends, math.nan, change, floor, signal))
    return out


def _pairs(method: Method, cube: Floats, i: int) -> Pairs:
    """Return the indices of the points of all pairs that differ in one input only."""
    dimensions = cube.shape[1]
    if method == "sobol":
        first = np.arange(0, len(cube), dimensions + 2)
        return first, first + 1 + i
    step = np.flatnonzero(np.diff(cube[:, i]) != 0.0)
    step = step[(step + 1) % (dimensions + 1) != 0]  # not between two trajectories
    return step, step + 1


def _change(
    place: Floats, values: Floats, first: NDArray[np.int64], second: NDArray[np.int64]
) -> float:
    """Return the least-squares slope of the changes of an output over those of an input."""
    moved, changed = place[second] - place[first], values[second] - values[first]
    slope = float(moved @ changed / (moved @ moved))
    return slope if abs(slope) > CHANGE_ROUNDING * float(np.abs(values).max()) else 0.0


def of_function(
    function: Callable[[Floats], Floats],
    parameters: Sequence[Parameter],
    method: Method = "sobol",
    samples: int = 1024,
    seed: int = 0,
) -> list[AnalysedInput]:
    """Return the indices of the parameters of any function.

    Parameters
    ----------
    function : callable
        Function of an (n, D) array of values of the parameters that returns an (n,) array.
    parameters : sequence of Parameter
        The parameters with their ranges.
    method : {"morris", "sobol"}
        The method.
    samples : int
        Number of trajectories, or of points; a power of two for "sobol".
    seed : int
        Seed of the points and of the bootstrap.

    Raises
    ------
    BadInput
        If the method or the number of samples is invalid.
    """
    cube = places(method, len(parameters), samples, seed)
    values = np.array(
        [[p.at(at)[0] for p, at in zip(parameters, row, strict=True)] for row in cube.tolist()]
    )
    return analyse(method, cube, Response.exact(function(values)), seed)


@dataclass(frozen=True, slots=True, eq=False)
class SensitivityPlan:
    """A sensitivity analysis of a site with a layout.

    Parameters
    ----------
    site, layout : Site, Layout
        The site and the layout.
    inputs : sequence of Parameter or Posterior
        The uncertain inputs.
    method : {"morris", "sobol"}
        The method.
    cube : (n, D) array
        The points in the unit cube.
    seeds : mapping of str to sequence of int
        Seeds of the releases of each event.
    sites : tuple of Site
        The site at each point.
    groups : tuple of (Site, tuple of int)
        Each site that is simulated, with the points that share its releases.
    seed : int
        Seed of the points, of the releases and of the bootstrap.
    """

    site: Site
    layout: Layout
    inputs: tuple[Input, ...]
    method: Method
    cube: Floats
    seeds: Seeds
    sites: tuple[Site, ...]
    groups: tuple[tuple[Site, tuple[int, ...]], ...]
    seed: int

    @property
    def size(self) -> int:
        """Number of releases to simulate."""
        return len(self.groups) * sum(map(len, self.seeds.values()))


def plan(
    site: Site,
    layout: Layout,
    inputs: Sequence[Input],
    method: Method = "morris",
    samples: int | None = None,
    releases: int = 200,
    seed: int = 0,
) -> SensitivityPlan:
    """Return the sites that an analysis needs.

    Parameters
    ----------
    site, layout : Site, Layout
        The site and the layout.
    inputs : sequence of Parameter or Posterior
        The uncertain inputs, see `rigdda.app.uncertainty.parameters.choose`.
    method : {"morris", "sobol"}
        The method.
    samples : int, optional
        Number of trajectories (Morris) or points (Sobol'), by default `SAMPLES`.
    releases : int
        Number of releases at each point, which are distributed over the events as in a design; the
        seeds are the same at all points.
    seed : int
        Seed of the points, of the bootstrap and of the first release.

    Raises
    ------
    BadInput
        If there are no inputs, the method or a number is invalid, or the layout does not fit the
        site at one of the points.
    """
    if not inputs:
        raise BadInput("--parameters", (), "name at least one number or group")
    cube = places(method, len(inputs), SAMPLES[method] if samples is None else samples, seed)
    seeds = seeds_of(site, releases, seed)
    sites = tuple(site_at(site, inputs, row) for row in cube)
    groups: dict[tuple[bytes, Layout], tuple[Site, list[int]]] = {}
    for i, varied in enumerate(sites):
        groups.setdefault((release_key(varied), varied.standing(layout)), (varied, []))[1].append(i)
    for varied, _ in groups.values():
        _check_room(varied, layout, inputs)
    simulated = tuple((varied, tuple(rows)) for varied, rows in groups.values())
    return SensitivityPlan(site, layout, tuple(inputs), method, cube, seeds, sites, simulated, seed)


def _check_room(varied: Site, layout: Layout, inputs: Sequence[Input]) -> None:
    """Check that larger blocks do not take the room of a barrier.

    Raises
    ------
    BadInput
        If they do; the message names the inputs that determine their sizes.
    """
    try:
        varied.built(layout, 1.0)
    except BadInput as bad:
        sizes = [path for one in inputs for path in one.paths if path.endswith(".size")]
        hint = f", or give --parameters with smaller values of {', '.join(sizes)}" if sizes else ""
        raise BadInput(bad.field, bad.value, bad.hint + hint) from None


def seeds_of(site: Site, releases: int, seed: int) -> Seeds:
    """Return the seeds of releases that are distributed over the events.

    They are distributed as in a design, but every design event has at least a quarter of their
    number, for its probabilities. Together they may therefore be more than `releases`.

    Raises
    ------
    BadInput
        If there are fewer than two releases per event.
    """
    least = 2 * len(site.events)
    count = check.integer("--releases", releases, least, JOB_RELEASES)
    shared = DesignProblem(site).allocation(count)
    design = {event.name for event in site.events if event.design}
    found = {n: max(shared[n], count // EVENT_DIVISOR if n in design else 0) for n in shared}
    return {name: range(seed, seed + n) for name, n in found.items()}


EVENT_DIVISOR = 4
"""A design event has at least the number of releases divided by this, for its probabilities."""


class Output(NamedTuple):
    """An output of a site: its name, its unit and its values."""

    name: str
    unit: str
    response: Response


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """Result of a sensitivity analysis: the outputs, and the indices of each by input."""

    plan: SensitivityPlan
    outputs: tuple[Output, ...]
    indices: tuple[tuple[AnalysedInput, ...], ...]
    resumed: int
    """Number of releases that an interrupted analysis left in the folder."""


def run(plan: SensitivityPlan, out: Path | None, tick: Tick) -> Sensitivity:
    """Simulate the sites of an analysis and return the indices.

    Parameters
    ----------
    plan : SensitivityPlan
        The analysis.
    out : path, optional
        Folder in which outcomes are kept until `rigdda.files.remove_unfinished`, so that an
        analysis that was killed continues from there.
    tick : callable
        Called with the number of releases so far and a description.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    each = sum(map(len, plan.seeds.values()))
    priced: list[Priced | None] = [None] * len(plan.sites)
    strata, resumed = np.zeros(0, dtype=np.int64), 0
    for done, (moves, rows) in enumerate(plan.groups):
        tick(done * each, f"simulating site {done + 1} of {len(plan.groups)}")
        (found,) = simulate(moves, (plan.layout,), plan.seeds, out)
        strata = found.strata
        resumed += each if found.resumed else 0
        for i in rows:
            priced[i] = price(plan.sites[i], plan.layout, found)
    tick(plan.size, "computing indices")
    outputs = tuple(_outputs(plan, [one for one in priced if one is not None], strata))
    indices = tuple(
        tuple(analyse(plan.method, plan.cube, output.response, plan.seed)) for output in outputs
    )
    return Sensitivity(plan, outputs, indices, resumed)


def _outputs(
    plan: SensitivityPlan, priced: Sequence[Priced], strata: NDArray[np.int64]
) -> Iterator[Output]:
    """Yield Z and, for each design event, P(reach) and, with barriers, P(failure)."""
    terms = np.array([one.terms for one in priced])
    z = np.array([one.objective for one in priced])
    yield Output("Z", "EUR per metre and year", Response(z, terms, strata))
    fallible = any(barrier.fallible for barrier in plan.site.standing(plan.layout))
    names = ["reached", "failed"] if fallible else ["reached"]
    for name in names:
        happened = np.array([getattr(one, name) for one in priced], dtype=np.float64)
        for event in plan.site.events:
            if event.design:
                here = strata == plan.site.event_names.index(event.name)
                share = happened * here / max(int(here.sum()), 1)
                words = "P(reach)" if name == "reached" else "P(failure)"
                yield Output(
                    f"{words} of {event.name}", "-", Response(share.sum(axis=1), share, strata)
                )
