"""Agent for the environment `rigdda/Corridor-v0` that builds each section without a search.

On the section at hand, the value network forecasts the cost of every single barrier, of pairs and
of barriers that are smaller than those of the catalogue, from releases without barriers
(`rigdda.agents.designers.forecast`). The agent builds the layout with the greatest forecast gain of
the section and of the sections to come together. What the money that is left will gain in the
sections to come follows from `Prospect`, which is learned from forecasts on training sites. This is
one step of approximate dynamic programming.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import BadInput, Layout, __version__, check, sites
from rigdda.agents import limits
from rigdda.agents.corridor.programme import Options, increments
from rigdda.agents.designers.catalogue import ensemble
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.forecast import Forecast, forecast_seeds, value_network
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.race import forecasts_of, single_barriers
from rigdda.agents.network import Network
from rigdda.envs import DesignProblem
from rigdda.envs.corridor_environment import CorridorDesign
from rigdda.model.site_names import CORRIDOR_SPLIT

Floats = NDArray[np.float64]

MOST_POINTS = 64
"""Largest number of points of a `Prospect`."""

PROSPECT_FILE = Path(__file__).parent / "prospect.safetensors"
"""The prospect that ships with the package."""


@dataclass(frozen=True, slots=True, eq=False)
class Offer:
    """Layouts of a section on the front of cost and forecast gain, the cheapest first.

    Parameters
    ----------
    layouts : tuple of Layout
        The layouts, the first one without barriers.
    cost : (K,) array
        Construction cost [EUR/m].
    gain : (K,) array
        Forecast reduction of the annual cost [EUR/m/year], ascending.
    """

    layouts: tuple[Layout, ...]
    cost: Floats
    gain: Floats


def offer(problem: DesignProblem) -> Offer:
    """Return the layouts of a site from which the agent chooses.

    Simulates releases without barriers only.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    menu, site = Menu(problem), problem.site
    crossings = ensemble(site, forecast_seeds(site), menu.stations)
    forecast = Forecast(problem, crossings, value_network())
    pool = forecasts_of(forecast, menu, [constant(problem, menu)], single_barriers(menu))
    pool.add((barrier,) for barrier in menu.smallest())
    layouts: list[Layout] = [()]
    costs, gains = [0.0], [0.0]
    capital, value = pool.capital - site.capital(()), pool.value()
    for k in np.lexsort((value, capital)).tolist():
        gain = pool.worth * (pool.bare - float(value[k]))
        if gain > gains[-1]:
            layouts.append(pool.layouts[k])
            costs.append(float(capital[k]))
            gains.append(gain)
    return Offer(tuple(layouts), np.array(costs), np.array(gains))


@dataclass(frozen=True, slots=True, eq=False)
class Prospect:
    """Average gain of money for construction that is spent where it gains most.

    Parameters
    ----------
    money : (P,) array
        Money per metre of road [EUR/m], ascending from 0.
    gain : (P,) array
        Share of the annual cost without barriers that is gained [-], concave in the money.
    """

    money: Floats
    gain: Floats

    def __call__(self, money: Floats) -> Floats:
        """Return the share of the annual cost without barriers that money gains [-]."""
        return np.interp(money, self.money, self.gain)

    def save(self, path: str | os.PathLike[str], command: str) -> None:
        """Write the prospect, with the command that made it, as one layer of a network."""
        layer = self.gain.reshape(1, -1).astype(np.float32), np.zeros(1, dtype=np.float32)
        money = self.money.astype(np.float32)
        notes = {"command": command, "version": __version__}
        Network(money, np.ones_like(money), [layer], notes).save(path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Prospect:
        """Read a prospect.

        Raises
        ------
        BadInput
            If the file is not a prospect.
        """
        network = Network.load(path)
        money = network.mean.astype(np.float64)
        gain = network.layers[0][0].astype(np.float64).ravel() if network.layers else money[:0]
        ascending = bool((np.diff(money) > 0.0).all() and (np.diff(gain) >= 0.0).all())
        if len(money) != len(gain) or len(money) < 2 or not ascending:
            hint = "name a file that `rigdda train --model corridor` wrote"
            raise BadInput("prospect", str(path), hint)
        return cls(money, gain)


def prospect(offers: Sequence[Offer], risks: Sequence[float]) -> Prospect:
    """Return the prospect of sections of equal length, from their layouts.

    Parameters
    ----------
    offers : sequence of Offer
        Layouts of each section.
    risks : sequence of float
        Annual cost of each section without barriers [EUR/m/year].
    """
    zeros = [np.zeros(len(own.cost)) for own in offers]
    costs, values = [own.cost for own in offers], [-own.gain for own in offers]
    steps = increments(Options(np.ones(len(offers)), costs, zeros, values, zeros))
    money = np.cumsum([0.0, *(step.cost for step in steps)]) / len(offers)
    gain = np.cumsum([0.0, *(step.saving for step in steps)]) / math.fsum(risks)
    if len(money) > MOST_POINTS:  # the early ones change most
        kept = np.unique(np.round((len(money) - 1) * np.linspace(0.0, 1.0, MOST_POINTS) ** 2))
        money, gain = money[kept.astype(int)], gain[kept.astype(int)]
    return Prospect(money, gain)


def train(count: int, seed: int, out: Path, tick: Callable[[int, str], None]) -> Prospect:
    """Learn the prospect from sites of the training split and write `prospect.safetensors`.

    Parameters
    ----------
    count : int
        Number of sites.
    seed : int
        Seed that selects the sites.
    out : path
        Folder to write into.
    tick : callable
        Receives the number of sites that are done and the name of the next one.

    Raises
    ------
    BadInput
        If the number of sites or the seed is out of range.
    Diverged
        If a simulation diverges.
    """
    names = sites.split(CORRIDOR_SPLIT)
    check.integer("sites", count, 2, len(names))
    check.integer("seed", seed, 0, limits.SEED)
    chosen = np.random.default_rng(seed).choice(len(names), count, replace=False)
    offers, risks = [], []
    for i, k in enumerate(chosen.tolist()):
        tick(i, names[k])
        problem = DesignProblem(names[k])
        offers.append(offer(problem))
        risks.append(problem.nothing.objective)
    found = prospect(offers, risks)
    command = f"rigdda train --model corridor --sites {count} --seed {seed}"
    found.save(out / "prospect.safetensors", command)
    return found


class CorridorAgent:
    """Agent for `rigdda/Corridor-v0`.

    Parameters
    ----------
    prospect : Prospect, optional
        What money gains in the sections to come, by default the prospect that ships with the
        package.

    Examples
    --------
    >>> env = gymnasium.make("rigdda/Corridor-v0", site="test")
    >>> agent = CorridorAgent()
    >>> observation, info = env.reset(seed=0)
    >>> observation, reward, *_ = env.step(agent.act(env.unwrapped))
    """

    def __init__(self, prospect: Prospect | None = None):
        self.prospect = prospect or shipped()
        self._offers: dict[bytes, Offer] = {}

    def layout(self, env: CorridorDesign) -> Layout:
        """Return the layout for the current section of an environment."""
        done = len(env.evaluations)
        section, ahead = env.placed[done], env.placed[done + 1 :]
        own = self.offer(section.problem)
        left = env.budget - env.spent - section.length * own.cost
        metres = math.fsum(s.length for s in ahead)
        risk = math.fsum(s.length * s.problem.nothing.objective for s in ahead)
        share = self.prospect(np.maximum(left, 0.0) / metres) if ahead else 0.0
        worth = section.length * own.gain + risk * share
        worth[left < 0.0] = -math.inf
        return own.layouts[int(np.argmax(worth))]

    def offer(self, problem: DesignProblem) -> Offer:
        """Return the layouts of a site; they are computed once."""
        key = msgspec.json.encode([problem.site, problem.kinds, problem.max_barriers])
        if key not in self._offers:
            self._offers[key] = offer(problem)
        return self._offers[key]

    def act(self, env: CorridorDesign) -> NDArray[np.float32]:
        """Return the action for the current section of an environment."""
        problem = env.problem
        return env.slots.encode(problem, self.layout(env)).astype(np.float32)


@lru_cache(maxsize=1)
def shipped() -> Prospect:
    """Return the prospect that ships with the package."""
    return Prospect.load(PROSPECT_FILE)
