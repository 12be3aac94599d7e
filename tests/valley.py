"""A design problem whose answer is known, and the fixtures of tests that use it."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from light_site import LIGHT

import rigdda
from rigdda import Barrier, Layout, Outcome, Site
from rigdda.agents.designers import catalogue
from rigdda.envs import DesignProblem, Evaluation, design_envelope, ensemble
from rigdda.envs.cost import judge
from rigdda.envs.outcome_cache import Sample

BEST, WIDE = 20.0, 4.0
"""Where a barrier catches most, and how far from there it still does [m]."""
CATCH, HEIGHT = 0.95, 3.0
"""Share of the releases that the best barrier keeps off the road, and the least height for it."""

SITE = LIGHT
"""The site of the problem."""


class Valley(DesignProblem):
    """A problem with a known answer, not simulated.

    Any barrier keeps releases off the road as if thrown by dice, most of all one of 3 m at 20 m;
    nothing ever fails.
    """

    @property
    def _known(self) -> ensemble.Ensemble:
        key = type(self), repr(self.site.consequences)  # sites of tests differ in nothing else
        if key not in KNOWN:
            KNOWN[key] = self._look()
        return KNOWN[key]

    def _look(self) -> ensemble.Ensemble:
        names = self.site.event_names
        free = Sample([self.outcome((), s, n) for n in names for s in range(10**9, 10**9 + 2000)])
        facts = ensemble._facts(self.site, free)
        shares = ensemble._shares(self.site, facts)
        nothing = judge(self.site, (), free, facts, shares)
        return ensemble.Ensemble(replace(nothing, outcomes=()), facts, shares)

    def catch(self, barrier: Barrier) -> float:
        size = getattr(barrier, "height", getattr(barrier, "depth", 0.0))
        return CATCH * math.exp(-(((barrier.x - BEST) / WIDE) ** 2)) * min(1.0, size / HEIGHT)

    def chance(self, layout: Layout) -> float:
        return math.prod(1.0 - self.catch(barrier) for barrier in layout)

    def truth(self, layout: Layout) -> float:
        """Return Z."""
        harm = self.site.consequences.harm(1.0, True)
        rates = sum(self.site.rate(name, layout) for name in self.site.event_names)
        return self.site.annual(layout) + rates * harm * self.chance(layout)

    def outcome(self, layout: Layout, seed: int, event: str) -> Outcome:
        code = zlib.crc32(repr(layout).encode())
        rng = np.random.default_rng([seed, code, self.site.event_names.index(event)])
        reached = bool(rng.random() < self.chance(layout))
        volume = 1.0 if reached else 0.0
        return replace(TEMPLATE, event=event, road_volume=volume, reached=reached, barriers=())

    def sample(self, layout: Sequence[Barrier], seeds: Mapping[str, Sequence[int]]) -> Sample:
        standing = self.check(layout)
        return Sample([self.outcome(standing, s, e) for e, own in seeds.items() for s in own])

    def evaluate(
        self, layout: Sequence[Barrier], seeds: Sequence[int], executor: Executor | None = None
    ) -> Evaluation:
        standing, drawn = self.check(layout), tuple(seeds)
        pairs = zip(drawn, self.plan(drawn), strict=True)
        found = Sample([self.outcome(standing, seed, event) for seed, event in pairs])
        return self.judge(standing, found, drawn)


def seen(
    site: Site, seeds: Mapping[str, Sequence[int]], stations: Sequence[float]
) -> catalogue.CrossingEnsemble:
    """Return crossings that say of standing barriers what holds in the valley."""
    x = np.asarray(stations, dtype=np.float64)
    jobs = [(i, seed) for i, own in enumerate(seeds.values()) for seed in own]
    table = np.zeros((len(jobs), len(x) + 1), dtype=catalogue.CROSSING)
    table["release"] = np.arange(len(jobs))[:, None]
    table["station"] = np.arange(len(x) + 1)
    table["time"] = np.arange(len(x) + 1)
    table["speed"], table["energy"], table["mass"], table["volume"] = 1.0, 1.0, 1.0, 1.0
    stopped = CATCH * np.exp(-(((x - BEST) / WIDE) ** 2))
    dice = [np.random.default_rng([seed, i]).random(len(x)) for i, seed in jobs]
    table["height"][:, :-1] = HEIGHT * np.array(dice) / stopped
    event = np.array([i for i, _ in jobs])
    return catalogue.CrossingEnsemble(x, table.ravel(), event, np.ones(len(jobs)))


KNOWN: dict[tuple[type, str], ensemble.Ensemble] = {}
TEMPLATE = replace(
    rigdda.release_many([(SITE, (), 1, "block")])[0], held_fraction=0.0, released_volume=1.0
)


class Barren(Valley):
    """Nothing keeps anything off."""

    def catch(self, barrier: Barrier) -> float:
        return 0.0


@pytest.fixture(scope="session")
def site() -> Site:
    return SITE


@pytest.fixture
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site)


@pytest.fixture
def few_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Release few blocks for design envelopes."""
    monkeypatch.setattr(design_envelope, "of", partial(design_envelope.of, blocks=60))


@pytest.fixture
def valley(site: Site, few_blocks: None, monkeypatch: pytest.MonkeyPatch) -> Valley:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    return Valley(site)
