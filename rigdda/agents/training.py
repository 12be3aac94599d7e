"""Training of a policy: in the learned model first, then on simulated outcomes.

The policy learns on a table of forecasts (`rigdda.agents.learning.forecasts`), which takes seconds.
Then it may learn on simulated outcomes of promising layouts (`rigdda.agents.learning.outcomes`).
Finally its layouts on validation sites are simulated beside those of simple rules.

A training writes into one folder and continues from it: `training.json` (the terms), `sites/`
(forecasts and outcomes of each site), `forecasts.safetensors` (the table), `evaluations.jsonl` (the
releases of the comparison) and `policy.safetensors`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS, BadInput, Layout, __version__, check, sites
from rigdda.agents import limits
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.forecast import NETWORK_FILE as VALUE_NETWORK
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.policy import Policy, decide, prior
from rigdda.agents.designers.protocol import verify
from rigdda.agents.designers.rule import answer
from rigdda.agents.designers.store import Store
from rigdda.agents.learning import forecasts, outcomes
from rigdda.agents.learning.relative_layouts import candidates, placed
from rigdda.agents.network import Network, scaled, scaling
from rigdda.agents.run_record import check_terms
from rigdda.envs import DesignProblem, forecast_table
from rigdda.envs.envelope import largest
from rigdda.envs.forecast_table import ForecastTable
from rigdda.files import atomic

Floats = NDArray[np.float64]
Tick = Callable[[int, str], None]

TRAIN, VALIDATION = "wide-train", "wide-validation"
"""Splits of the sites of a new table and of the comparison."""

ALGORITHMS = ("gradient", "ppo")
"""Algorithms for learning on forecasts, see `rigdda.agents.learning`."""

MEMBERS = 3
"""Number of networks with different seeds, of which the scores are averaged."""

MASS = 100
"""Number of blocks of an event from which a site is left out of the comparison, since one of its
releases takes as long as hundreds of others."""

FRESH = 2
"""Seed of the releases of the comparison, which no search and no training draws."""

RECORD = "training.json"
"""File with the terms of a training."""

OF_TABLE = ("table", "table command")
"""Terms that are known only with the table of forecasts: its digest and its command."""

FILES = (RECORD, "policy.safetensors")
"""Files that a training writes into its folder besides those of the sites."""


@dataclass(frozen=True, slots=True)
class Terms:
    """Terms of a training.

    Parameters
    ----------
    sites : int
        Number of training sites for a new table of forecasts, at least 2; or 0 for the table that
        ships with the package.
    algorithm : str
        One of `ALGORITHMS`.
    simulate : int
        Number of layouts of each training site to simulate; 0 for forecasts alone.
    seed : int
        Seed of all random numbers.
    """

    sites: int = 0
    algorithm: str = "gradient"
    simulate: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.sites:
            check.integer("sites", self.sites, 2, len(sites.split(TRAIN)))
        check.one_of("algorithm", self.algorithm, ALGORITHMS)
        check.integer("simulate", self.simulate, 0, forecasts.LAYOUTS)
        check.integer("seed", self.seed, 0, limits.SEED)

    @property
    def command(self) -> str:
        """The command with these terms."""
        made = f" --sites {self.sites}" if self.sites else ""
        made += f" --algorithm {self.algorithm} --simulate {self.simulate} --seed {self.seed}"
        return "rigdda train" + made


@dataclass(frozen=True, slots=True)
class Compared:
    """Z of one layout on one site, from fresh releases.

    Parameters
    ----------
    site, method : str
        The site and the method that chose the layout.
    z, nothing : float
        Z with the layout and without barriers [EUR per metre of road and year].
    """

    site: str
    method: str
    z: float
    nothing: float


def train(terms: Terms, out: Path, tick: Tick) -> Policy:
    """Train a policy, or continue an interrupted training; write it to `policy.safetensors`.

    Forecasts and outcomes of completed sites are kept. Learning takes seconds and is repeated.
    Repeating a training gives the same file on the same machine. A training that is refused changes
    nothing in the folder: the terms are checked first, and the digest of the table of forecasts
    before the table is written.

    Raises
    ------
    BadInput
        If the folder contains a training on other terms, or torch is not installed.
    Diverged
        If a simulation diverges.
    """
    network = hashlib.sha256(VALUE_NETWORK.read_bytes()).hexdigest()[:16]
    versions = {"version": __version__, "mechanics": MECHANICS, "value network": network}
    known = recorded_terms(out)
    _agree(asdict(terms) | {"command": terms.command} | versions, known, out)
    table = table_of(terms, out, tick)
    digest = hashlib.sha256(table.z.tobytes() + table.features.tobytes()).hexdigest()[:16]
    own = dict(zip(OF_TABLE, (digest, table.notes.get("command", "")), strict=True))
    _agree(own, known, out)
    notes = {
        "command": terms.command, "version": __version__, "mechanics": MECHANICS,
        **own, "value network": network,
    }  # fmt: skip
    with atomic(out / RECORD) as part:
        part.write_bytes(msgspec.json.encode(asdict(terms) | notes))
    if terms.sites:
        table.save(out / "forecasts.safetensors")
    z = None
    if terms.simulate:
        folder = out / "sites"
        folder.mkdir(exist_ok=True, parents=True)
        z = outcomes.collect(table, terms.simulate, folder, tick)
    policy = Policy(learn(terms, table, z, notes, tick), table.layouts)
    policy.save(out / "policy.safetensors")
    return policy


def table_of(terms: Terms, out: Path, tick: Tick) -> ForecastTable:
    """Return the table of the package, or make one of the requested number of training sites.

    The forecasts of each site are kept in the folder `sites`. The numbers are rounded as those of a
    table that is read from a file.

    Raises
    ------
    BadInput
        If the table of the package is of another version of the mechanics.
    """
    if not terms.sites:
        table = forecast_table.load()
        if table.notes["mechanics"] != MECHANICS:
            hint = "the table of the package is of another version of the mechanics: give --sites N"
            raise BadInput("table", table.notes["mechanics"], hint)
        return table
    folder, catalogue = out / "sites", candidates()
    folder.mkdir(parents=True, exist_ok=True)
    names = sites.split(TRAIN)[: terms.sites]
    found = forecasts.collect(names, catalogue, folder, tick)
    z = np.array([own.z for own in found.values()])
    kept = forecasts.choose(z, catalogue, forecasts.LAYOUTS)
    notes = {"command": f"rigdda train --sites {terms.sites}"}
    return forecasts.table(found, catalogue, kept, notes).rounded()


def learn(
    terms: Terms, table: ForecastTable, z: Floats | None, notes: dict[str, str], tick: Tick
) -> Network:
    """Return the network of a policy that learnt on forecasts and, if given, on outcomes.

    Raises
    ------
    BadInput
        If torch is not installed.
    """
    try:
        import torch

        from rigdda.agents.learning import exact_gradient, pointer, ppo
    except ModuleNotFoundError as error:
        hint = f"install {error.name}: pip install 'rigdda[rl]'"
        raise BadInput("model", "policy", hint) from None
    rows = table.rows("train")
    given, mask = table.features[rows], table.mask[rows]
    bare = Network(*scaling(given[mask]), [], notes)
    torch.set_num_threads(1)
    features = torch.tensor(scaled(given, bare.mean, bare.scale))
    score, built = torch.tensor(prior(given)), torch.tensor(mask)
    members = []
    for k in range(MEMBERS):
        seed = MEMBERS * terms.seed + k
        member = pointer.Pointer(given.shape[2], seed)
        one = partial(tick, k, f"learning, network {k + 1} of {MEMBERS}")
        reward = torch.tensor(table.reward[rows], dtype=torch.float32)
        if terms.algorithm == "ppo":
            ppo.learn(member, table, bare, seed, one)
        else:
            exact_gradient.learn(member, features, score, built, reward, seed, one)
        if z is not None:
            reward = torch.tensor(np.where(mask, 1.0 - z, 0.0), dtype=torch.float32)
            exact_gradient.learn(member, features, score, built, reward, seed, one)
        members.append(member)
    return pointer.export(members, bare.mean, bare.scale, notes)


def recorded_terms(out: Path) -> dict[str, Any] | None:
    """Return the terms of the training in a folder, or None if there is none.

    Raises
    ------
    BadInput
        If their file is damaged.
    """
    file = out / RECORD
    if not file.is_file():
        return None
    try:
        return msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
    except msgspec.MsgspecError as error:
        hint = f"remove the damaged training, or name another folder with --out ({error})"
        raise BadInput("terms", str(file), hint) from None


def _agree(asked: dict[str, Any], known: dict[str, Any] | None, out: Path) -> None:
    """Check that terms are those of the training in a folder, if there is one.

    They are either the terms that are known before the table of forecasts, or those of the table.
    """
    if known is not None:
        of_table = set(asked) == set(OF_TABLE)
        found = {name: value for name, value in known.items() if (name in OF_TABLE) == of_table}
        check_terms(asked, found, f"the training in {out}")


def best_of_families(table: ForecastTable) -> dict[str, list[int]]:
    """Return for each family the catalogue in the order of mean forecast Z on its training sites.

    A layout that cannot be built on a site counts as no barrier there. Layouts are given by their
    numbers in the catalogue, the best first.
    """
    rows = table.rows("train")
    families = np.array([sites.family_of(table.names[row]) for row in rows])
    reward = table.reward[rows]
    return {
        name: np.argsort(-reward[families == name].mean(axis=0), kind="stable").tolist()
        for name in dict.fromkeys(families.tolist())
    }


def methods(policy: Policy, table: ForecastTable, problem: DesignProblem) -> dict[str, Layout]:
    """Return the layouts of the policy and of the rules that it is compared with.

    The rules are no barrier, the constant, the engineering rule, the best layout of the family that
    can be built (`best_of_families`), which uses the family of the site, and the layout of the
    policy's catalogue with the least forecast Z.
    """
    menu = Menu(problem)
    order = best_of_families(table).get(sites.family_of(problem.site.name), [0])
    family = (placed(menu, table.layouts[i]) for i in order)
    forecast = forecasts.of_site(problem, policy.layouts)
    found = {
        "nothing": (),
        "constant": constant(problem, menu),
        "rule": answer(problem).layout,
        "best of the family": next((layout for layout in family if layout is not None), ()),
        "least forecast": forecast.layouts[int(np.nanargmin(forecast.z))] or (),
        "policy": decide(policy, problem),
    }
    return {name: layout if problem.fits(layout) else () for name, layout in found.items()}


def comparison_sites(count: int) -> list[str]:
    """Return the names of the first validation sites.

    Raises
    ------
    BadInput
        If there are fewer than `count`.
    """
    names = sites.split(VALIDATION)
    return list(names[: check.integer("--compare", count, 0, len(names))])


def compare(
    policy: Policy, out: Path, terms: Terms, names: Sequence[str], releases: int, tick: Tick
) -> list[Compared]:
    """Compare a policy with simple rules on validation sites.

    Parameters
    ----------
    policy : Policy
        The policy.
    out : Path
        The folder of its training.
    terms : Terms
        The terms of its training.
    names : sequence of str
        The validation sites that are tried, see `comparison_sites`.
    releases : int
        Number of fresh releases of each layout, the same for all methods.
    tick : callable
        Called with the number of completed sites and a description.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    table, store = table_of(terms, out, tick), Store(out / "evaluations.jsonl")
    return compared(policy, table, names, releases, store, tick)


def compared(
    policy: Policy, table: ForecastTable, names: Sequence[str], releases: int, store: Store,
    tick: Tick,
) -> list[Compared]:  # fmt: skip
    """Return Z of the policy and of the simple rules on sites, on the same fresh releases.

    Z of no barrier is known from the stored releases of a site. Sites with an event of `MASS`
    blocks or more are left out.

    Raises
    ------
    Diverged
        If a simulation diverges.
    """
    found = []
    for i, name in enumerate(names):
        tick(i, f"comparison on {name}")
        problem = forecasts.problem(name)
        if max(largest(problem.site, event) for event in problem.site.event_names) >= MASS:
            continue
        for method, layout in methods(policy, table, problem).items():
            z = verify(problem, layout, releases, FRESH, store).objective if layout else None
            nothing = problem.nothing.objective
            found.append(Compared(name, method, nothing if z is None else z, nothing))
    return found


def relative(rows: Sequence[Compared], method: str) -> Floats:
    """Return Z of a method over Z without barriers on each site [-]."""
    return np.array([row.z / row.nothing for row in rows if row.method == method])
