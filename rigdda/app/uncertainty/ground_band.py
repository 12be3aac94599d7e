"""Band of a design: costs and risks of its layouts over the plausible range of the ground.

The ground is the least certain input of a design. Layouts that were designed for the values of the
site are evaluated on sites whose surfaces have other rolling resistance, restitution and friction,
within the ranges of the library of grounds or from the posterior of a fit. All sites and layouts
are evaluated on the same releases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import Site
from rigdda.app.design_study import DesignStudy, VerifiedLayout, design_events
from rigdda.app.uncertainty.parameters import (
    Input,
    Posterior,
    check_limits,
    ground,
    site_at,
)
from rigdda.app.uncertainty.varied_sites import Priced, SimulatedSite, noise, price, simulate
from rigdda.envs import DesignProblem, Evaluation, ensemble
from rigdda.envs.cost import judge
from rigdda.envs.problem import MISSED, can_fail
from rigdda.seeds import release_seeds

Floats = NDArray[np.float64]
Tick = Callable[[int, str], None]

INVALID_GROUND = "give 0, or another --posterior: the site is invalid with the values of a ground"
"""Remedy if a ground that was drawn makes the site invalid."""

RELEASES_PER_GROUND = 120
"""Number of releases of each layout on each ground."""

CLEAR_ERRORS = 1.96
"""Standard errors from which two values of Z on the same releases count as different [-]."""

State = Literal["cheapest", "undecided", "dearer", "missed"]


class BandLayout(NamedTuple):
    """A layout on one ground.

    Parameters
    ----------
    name : str
        Name of the layout.
    evaluation : Evaluation
        Its evaluation on this ground.
    priced : Priced
        Its cost in each release.
    comparable : bool
        Whether it may be chosen; not if it fails a required check.
    fallible : bool
        Whether one of the barriers that stand with it can fail.
    targets : {"met", "missed", "undecided"} or None
        Whether it meets the targets of the design on this ground; None if there are none.
    """

    name: str
    evaluation: Evaluation
    priced: Priced
    comparable: bool = True
    fallible: bool = True
    targets: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class GroundSample:
    """The layouts of a design on one ground.

    Parameters
    ----------
    values : dict of str to float
        The values that differ from those of the site, by their paths.
    cases : tuple of BandLayout
        The layouts; the last one is the chosen layout.
    strata : (R,) array
        Event of each release.
    """

    values: dict[str, float]
    cases: tuple[BandLayout, ...]
    strata: NDArray[np.int64]

    @property
    def targets(self) -> str | None:
        """Whether the chosen layout meets the targets of the design; None if there are none."""
        return self.cases[-1].targets

    @property
    def cheapest(self) -> BandLayout:
        """The layout with the least Z of those that may be chosen and do not miss the targets.

        The chosen layout must be one of them, see `state`.
        """
        own = [case for case in self.cases if case.comparable and case.targets != MISSED]
        return min(own, key=lambda case: case.priced.objective)

    @property
    def state(self) -> State:
        """Whether the chosen layout is the cheapest, costs more than another, or is undecided.

        It is compared with the layouts that do not miss the targets. It is undecided if one of them
        is cheaper, but not by more than the noise of the difference on the same releases. If the
        chosen layout misses the targets, the state is "missed", and costs are not compared.
        """
        if self.targets == MISSED:
            return "missed"
        chosen, best = self.cases[-1].priced, self.cheapest.priced
        if chosen.objective <= best.objective:
            return "cheapest"
        error = math.sqrt(float(noise((chosen.terms - best.terms)[None], self.strata)[0]))
        costs_more = chosen.objective - best.objective > CLEAR_ERRORS * error
        return "dearer" if costs_more else "undecided"


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """The layouts of a design on all grounds.

    Parameters
    ----------
    samples : tuple of GroundSample
        The grounds.
    releases : int
        Number of releases of each layout on each ground.
    source : str
        Where the grounds come from, in words.
    events : tuple of str
        The design events.
    """

    samples: tuple[GroundSample, ...]
    releases: int
    source: str
    events: tuple[str, ...]


def inputs(site: Site, posterior: Posterior | None) -> tuple[Input, ...]:
    """Return the uncertain numbers of the ground; a posterior replaces those that it contains.

    Raises
    ------
    BadInput
        If the site is invalid at a limit.
    """
    joint = () if posterior is None else (posterior,)
    known = {path for one in joint for path in one.paths}
    others = tuple(one for one in ground(site) if one.path not in known)
    check_limits(site, others)
    return (*joint, *others)


def assess(
    done: DesignStudy,
    grounds: int,
    posterior: Posterior | None,
    seed: int,
    out: Path,
    tick: Tick,
) -> Band:
    """Evaluate the layouts of a design on a Latin hypercube of grounds.

    Parameters
    ----------
    done : DesignStudy
        The design, whose verified layouts are compared.
    grounds : int
        Number of grounds.
    posterior : Posterior, optional
        Posterior of a fit, which replaces the plausible range of its numbers.
    seed : int
        Seed of the hypercube. The releases are the first of the verification.
    out : path
        Folder in which outcomes are kept until `rigdda.files.remove_unfinished`.
    tick : callable
        Called with the number of grounds so far and a description.

    Raises
    ------
    BadInput
        If the site is invalid at a limit of a number.
    Diverged
        If a simulation diverges.
    """
    from scipy.stats import qmc  # takes half a second

    problem, asked = done.problem, inputs(done.problem.site, posterior)
    cube = qmc.LatinHypercube(len(asked), rng=np.random.default_rng(seed)).random(grounds)
    compared = [case for case in done.cases if case is not done.unchecked]
    comparable = {case.name for case in done.comparable}
    layouts = [case.evaluation.layout for case in compared]
    seeds, samples = _seeds(problem, seed), []
    for i, place in enumerate(cube):
        tick(i, f"ground {i + 1} of {grounds}")
        name = f"{problem.site.name}, ground {i + 1}"  # for warnings
        ground = site_at(problem.site, asked, place, "--ground-samples", INVALID_GROUND)
        site = msgspec.structs.replace(ground, name=name)
        found = simulate(site, layouts, seeds, out)
        pairs = zip(asked, place.tolist(), strict=True)
        values = {p: v for one, at in pairs for p, v in zip(one.paths, one.at(at), strict=True)}
        cases = tuple(
            _case(problem, case, site, one)._replace(comparable=case.name in comparable)
            for case, one in zip(compared, found, strict=True)
        )
        samples.append(GroundSample(values, cases, found[0].strata))
    source = "plausible range of the library of grounds" if posterior is None else "posterior"
    count = sum(map(len, seeds.values()))
    return Band(tuple(samples), count, source, design_events(problem.site))


def _seeds(problem: DesignProblem, seed: int) -> dict[str, Sequence[int]]:
    """Return the seeds of each event: the first of the verification, distributed as there."""
    events = len(problem.site.events)
    count = max(RELEASES_PER_GROUND, 2 * events)
    drawn = release_seeds("verification", seed, count)
    found: dict[str, list[int]] = {name: [] for name in problem.site.event_names}
    for name, own in zip(problem.plan(drawn), drawn, strict=True):
        found[name].append(own)
    return dict(found)


def _case(
    problem: DesignProblem, case: VerifiedLayout, site: Site, found: SimulatedSite
) -> BandLayout:
    """Return a layout of the design `problem` on one ground, with which `site` was simulated."""
    layout, facts = case.evaluation.layout, ensemble.of(problem.site, problem.key).facts
    evaluation = judge(site, layout, found.outcomes, facts, {})
    return BandLayout(
        name=case.name,
        evaluation=evaluation,
        priced=price(site, layout, found),
        fallible=can_fail(site, layout),
        targets=problem.state(evaluation),
    )
