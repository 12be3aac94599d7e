"""Candidates for the best layout of a site: a catalogue of singles and pairs, raced."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rigdda import Barrier, Layout
from rigdda.agents.designers.menu import Menu
from rigdda.envs import DesignProblem
from rigdda.seeds import release_seeds

KEPT = 0.3
"""Fraction of the candidates that advances to the next round."""
LEFT = 16
"""Number of candidates at which a race ends."""
PAIR_STATIONS = 8
"""Number of parts of the zone. In each part, the best single barrier of each kind is used for
pairs."""
PAIRS = 240
"""Number of pairs that are raced, the most promising ones."""
CHUNK = 20_000
"""Number of releases that are simulated together, whose outcomes are held in memory."""


def kinds_of(layout: Layout) -> str:
    """Return the names of the kinds of a layout, each once."""
    return " + ".join(sorted({barrier.words for barrier in layout})) or "nothing"


def catalogue(menu: Menu, stations: int) -> list[Layout]:
    """Return all single-barrier layouts of a problem at this number of stations, kind by kind."""
    own = menu.stations[:: max(1, len(menu.stations) // stations)].tolist()
    singles: list[Barrier] = []
    for kind in menu.problem.kinds:
        found = menu.singles(kind)
        ends = {b.x for b in found} - set(menu.stations.tolist())
        singles += [b for b in found if kind == "mesh" or b.x in ends or b.x in own]
    return [(barrier,) for barrier in singles]


class Candidate:
    """A layout and its mean costs by event so far."""

    def __init__(self, problem: DesignProblem, layout: Layout):
        site = problem.site
        self.problem, self.layout, self.annual = problem, layout, site.annual(layout)
        self.rates = {name: site.rate(name, layout) for name in site.event_names}
        self.bills: dict[str, list[float]] = {name: [] for name in self.rates}

    @property
    def z(self) -> float:
        """Estimate of Z so far [EUR per metre of road and year]."""
        means = ((r, self.bills[name]) for name, r in self.rates.items())
        return self.annual + sum(r * float(np.mean(b)) for r, b in means if b)


def look(problem: DesignProblem, field: Sequence[Candidate], n: int) -> None:
    """Increase the number of releases of each candidate to `n`, the same ones for all.

    Events that would have no more than two releases are left out, because a mass takes as long as
    hundreds of single blocks.
    """
    counts = {name: count for name, count in problem.allocation(n).items() if count > 2}
    seeds = {name: release_seeds("search", 0, count) for name, count in counts.items()}
    for low in range(0, len(field), max(1, CHUNK // n)):
        part = field[low : low + max(1, CHUNK // n)]
        asks = [(c.layout, {k: own[len(c.bills[k]) :] for k, own in seeds.items()}) for c in part]
        for candidate, sample in zip(part, problem.sample_many(asks), strict=True):
            for outcome in sample:
                bill = problem.site.bill(candidate.layout, outcome)
                candidate.bills[outcome.event].append(sum(bill))


def race(problem: DesignProblem, layouts: Iterable[Layout], first: int) -> list[Candidate]:
    """Return all candidates of a race by sequential halving, best first."""
    field = [Candidate(problem, layout) for layout in dict.fromkeys(layouts)]
    alive, n = field, first
    out: list[Candidate] = []
    while True:
        look(problem, alive, n)
        alive = sorted(alive, key=lambda c: c.z)
        if len(alive) <= LEFT:
            return alive + out[::-1]
        kept = max(LEFT, int(KEPT * len(alive)))
        out += alive[kept:][::-1]
        alive, n = alive[:kept], 2 * n


def pairs(problem: DesignProblem, singles: Sequence[Candidate]) -> list[Layout]:
    """Return the most promising pairs, assuming that the barriers act independently."""
    nothing = Candidate(problem, ())
    look(problem, [nothing], max(sum(map(len, c.bills.values())) for c in singles))
    zone, best = problem.zone, dict[tuple[str, int], Candidate]()
    for c in sorted(singles, key=lambda c: c.z):
        part = int(PAIR_STATIONS * (c.layout[0].x - zone.start) / (zone.end - zone.start))
        best.setdefault((c.layout[0].kind, part), c)
    found: dict[Layout, float] = {}
    for one in best.values():
        for two in best.values():
            both = tuple(sorted((*one.layout, *two.layout), key=lambda b: b.x))
            if one is two or both in found or not problem.fits(both):
                continue
            value = one.annual + two.annual
            for name in nothing.rates:
                bills = nothing.bills[name], one.bills[name], two.bills[name]
                if all(bills) and any(bills[0]):
                    base, first, second = (float(np.mean(b)) for b in bills)
                    value += problem.site.rate(name, both) * first * second / base
            found[both] = value
    return sorted(found, key=lambda layout: found[layout])[:PAIRS]


def contenders(problem: DesignProblem, stations: int, first: int) -> list[Layout]:
    """Return the two best layouts of every combination of kinds."""
    menu = Menu(problem)
    singles = race(problem, [(), *catalogue(menu, stations)], first)
    built = [c for c in singles if c.layout]
    double = race(problem, pairs(problem, built), first)
    near: list[Layout] = []
    length = problem.zone.end - problem.zone.start
    for centre in [*singles[:3], *double[:3]]:
        for step, level in ((length / 40.0, 1), (length / 80.0, 1)):
            near += menu.neighbours(centre.layout, step, level)
    last = race(problem, [*near, *(c.layout for c in [*singles[:LEFT], *double[:LEFT]])], 4 * first)
    return best_by_kind([*last, *double, *singles])


def best_by_kind(candidates: Iterable[Candidate]) -> list[Layout]:
    """Return the first two layouts of every combination of kinds."""
    kept: dict[str, list[Layout]] = {}
    for candidate in candidates:
        own = kept.setdefault(kinds_of(candidate.layout), [])
        if len(own) < 2 and candidate.layout not in own:
            own.append(candidate.layout)
    return [layout for group in kept.values() for layout in group]
