"""Training of the value network of layouts on simulated layouts of generated sites.

A training writes into one folder and continues from it: `value.json` (the terms), one `NAME.npz`
for each site with the features and the outcomes of its layouts, and `value.safetensors`.
"""

from __future__ import annotations

import itertools
import zipfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from rigdda import MECHANICS, BadInput, Layout, __version__, check, sites
from rigdda.agents import limits
from rigdda.agents.designers.catalogue import CrossingEnsemble, ensemble
from rigdda.agents.designers.constant import constant
from rigdda.agents.designers.forecast import Forecast, forecast_seeds
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.race import joined
from rigdda.agents.network import Network, scaling
from rigdda.agents.run_record import check_terms
from rigdda.envs import DesignProblem
from rigdda.envs.envelope import largest
from rigdda.files import atomic
from rigdda.model.site_names import VALUE_SPLIT
from rigdda.seeds import release_seeds

Floats = NDArray[np.float64]
Tick = Callable[[int, str], None]

FEW = 6
"""Number of releases of each event to which an ensemble is reduced for a second set of features, as
with a small budget."""
LAYOUT_RELEASES, LEAST_PER_EVENT, LEAST_PER_GROUP = 72, 10, 4
"""Releases of a layout over all events, the least number for an event, and the same for an event of
more than `GROUP` blocks."""
GROUP, MASS = 8, 100
"""Numbers of blocks of an event. Events of `MASS` blocks or more are not simulated with layouts."""
RANDOM, SINGLES, PAIRS = 18, 7, 20
"""Numbers of random layouts, of random and of promising single barriers of each kind, and of pairs
of promising barriers."""
HALF_WEIGHT_ERROR = 0.15
"""Standard error of a share that halves the weight of a sample [-]."""
HIDDEN, MEMBERS, EPOCHS, BATCH = 32, 4, 40, 128
"""Width of the two hidden layers, number of networks in the ensemble of networks, passes over the
samples and size of a batch."""
RATE, DECAY, JITTER = 3e-3, 0.03, 0.05
"""Learning rate, weight decay, and standard deviation of the noise added to scaled features."""
VALUE_FILES = ("value.json", "value.safetensors")
"""Files that a training writes besides those of the sites."""


@dataclass(frozen=True, slots=True)
class ValueTerms:
    """Terms of a training of the value network.

    Parameters
    ----------
    sites : int
        Number of training sites, at least 2.
    seed : int
        Seed of all random numbers.
    """

    sites: int
    seed: int

    def __post_init__(self) -> None:
        check.integer("sites", self.sites, 2, len(sites.split(VALUE_SPLIT)))
        check.integer("seed", self.seed, 0, limits.SEED)


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Samples of a site: n pairs of a layout and an event.

    Parameters
    ----------
    features : (n, WIDTH) array
        Features.
    share : (n,) array
        Remaining share of the risk of the event [-].
    weight : (n,) array
        Weight, of which the sum is about the same for each site.
    """

    features: Floats
    share: Floats
    weight: Floats

    def save(self, path: Path) -> None:
        """Write the samples to a file."""
        with atomic(path) as part, part.open("wb") as file:
            np.savez_compressed(file, **asdict(self))

    @classmethod
    def load(cls, path: Path) -> Samples:
        """Read samples from a file.

        Raises
        ------
        BadInput
            If the file is damaged.
        """
        try:
            with np.load(path) as file:
                return cls(file["features"], file["share"], file["weight"])
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            hint = f"this is damaged: remove this file and repeat the command ({error})"
            raise BadInput("samples", str(path), hint) from None


def train(terms: ValueTerms, out: Path, tick: Tick) -> Network:
    """Train the value network, or continue an interrupted training.

    Raises
    ------
    BadInput
        If the folder contains a training on other terms, or if torch is not installed.
    Diverged
        If a simulation diverges.
    """
    _agree(terms, out)
    found = []
    for i, name in enumerate(sites.split(VALUE_SPLIT)[: terms.sites]):
        tick(i, name)
        path = out / f"{name}.npz"
        if not path.is_file():
            collect(DesignProblem(name), np.random.default_rng([terms.seed, i])).save(path)
        found.append(Samples.load(path))
    command = f"rigdda train --model value --sites {terms.sites} --seed {terms.seed}"
    notes = {"command": command, "version": __version__, "mechanics": MECHANICS}
    network = fit(found, terms.seed, notes)
    network.save(out / "value.safetensors")
    return network


def _agree(terms: ValueTerms, out: Path) -> None:
    """Record the terms in the folder, or check that they are those of the training in it."""
    file, asked = out / "value.json", asdict(terms) | {"mechanics": MECHANICS}
    if file.is_file():
        try:
            found = msgspec.json.decode(file.read_bytes(), type=dict[str, Any])
        except msgspec.MsgspecError as error:
            hint = f"remove the damaged training, or name another folder with --out ({error})"
            raise BadInput("terms", str(file), hint) from None
        check_terms(asked, found, f"the training in {out}")
    with atomic(file) as part:
        part.write_bytes(msgspec.json.encode(asked))


def collect(problem: DesignProblem, rng: np.random.Generator) -> Samples:
    """Return the samples of a site: features and simulated outcomes of many layouts."""
    site, menu = problem.site, Menu(problem)
    sizes = {name: largest(site, name) for name in site.event_names}
    whole = ensemble(site, forecast_seeds(site), menu.stations)
    layouts = propose(menu, Forecast(problem, whole), rng)
    shares, variances = outcomes(problem, layouts, sizes)
    known = np.isfinite(shares)
    part = np.array([problem.nothing.by_event[name] for name in site.event_names])
    part = np.maximum(part / max(part.sum(), 1e-300), 0.05)
    weight = (part * HALF_WEIGHT_ERROR**2 / (HALF_WEIGHT_ERROR**2 + variances))[known] / max(
        known.sum(), 1
    )
    sets = []
    for crossings in (whole, first_releases(whole, FEW)):
        forecast = Forecast(problem, crossings)
        sets.append(np.array([forecast.features(layout) for layout in layouts])[known])
    share = np.clip(shares[known], 0.0, 1.5)
    return Samples(np.concatenate(sets), np.tile(share, 2), np.tile(weight, 2))


def propose(menu: Menu, forecast: Forecast, rng: np.random.Generator) -> list[Layout]:
    """Return the layouts to simulate, no barrier first.

    They are the constant, random layouts, random and promising single barriers of each kind, and
    pairs of promising ones.
    """
    problem = menu.problem
    low, high = problem.bounds
    out: list[Layout] = [(), constant(problem, menu)]
    out += [problem.decode(rng.uniform(low, high)) for _ in range(RANDOM)]
    tops: list[list[Layout]] = []
    most = 0.9 * problem.nothing.objective
    for kind in problem.kinds:
        singles = [(b,) for b in menu.singles(kind) if problem.site.annual((b,)) < most]
        if not singles:
            continue
        share = [float(forecast.analytic(x)[0].mean()) for x in singles]
        cost = [problem.site.annual(x) / max(problem.nothing.objective, 1e-9) for x in singles]
        order = np.argsort(np.add(share, cost), kind="stable")
        best = order[: max(1, len(order) // 12)]
        for among in (order, best):
            some = rng.choice(among, min(SINGLES, len(among)), replace=False)
            out += [singles[i] for i in some.tolist()]
        tops.append([singles[i] for i in order[: max(3, len(order) // 6)].tolist()])
    pairs: dict[Layout, None] = {}
    for _ in range(300 if tops else 0):
        one, two = (tops[i][rng.integers(len(tops[i]))] for i in rng.integers(len(tops), size=2))
        both = [x for x in joined(problem, [one], [two]) if problem.site.annual(x) < most]
        pairs |= dict.fromkeys(both)
        if len(pairs) >= PAIRS:
            break
    return list(dict.fromkeys([*out, *pairs]))


def outcomes(
    problem: DesignProblem, layouts: list[Layout], sizes: dict[str, int]
) -> tuple[Floats, Floats]:
    """Return the remaining share of the risk of each event and its variance, two (n, E) arrays.

    All layouts have the same releases. The share is a regression on the known cost without
    barriers. It is NaN for events that are not simulated or that cost nothing.
    """
    site, usual = problem.site, problem.nothing.by_event
    counts = {
        name: max(count, LEAST_PER_EVENT if sizes[name] <= GROUP else LEAST_PER_GROUP)
        for name, count in problem.allocation(LAYOUT_RELEASES).items()
        if sizes[name] < MASS and usual[name] > 0.0
    }
    seeds = {name: release_seeds("search", 0, count) for name, count in counts.items()}
    found = [_bills(problem, layout, seeds) for layout in layouts]
    shares, variances = np.full((2, len(layouts), len(site.event_names)), np.nan)
    for k, name in enumerate(site.event_names):
        for i, layout in enumerate(layouts if name in seeds else ()):
            own, bare = found[i][name], found[0][name]
            apart = bare - bare.mean()
            squares = float(apart @ apart)
            slope = min(max(float(apart @ own) / squares, 0.0), 1.0) if squares > 0.0 else 0.0
            left, before = own - slope * bare, usual[name] / site.rate(name, ())
            scale = site.rate(name, layout) / usual[name]
            shares[i, k] = scale * max(float(left.mean()) + slope * before, 0.0)
            spread = float(np.square(left - left.mean()).sum()) + float(bare.var())
            variances[i, k] = scale**2 * spread / len(own) ** 2
    return shares, variances


def _bills(
    problem: DesignProblem, layout: Layout, seeds: dict[str, tuple[int, ...]]
) -> dict[str, Floats]:
    """Return the bill of every release of each event [EUR]."""
    bills: dict[str, list[float]] = {name: [] for name in seeds}
    for outcome in problem.sample(layout, seeds):
        bills[outcome.event].append(sum(problem.site.bill(layout, outcome)))
    return {name: np.array(own) for name, own in bills.items()}


def first_releases(whole: CrossingEnsemble, count: int) -> CrossingEnsemble:
    """Return an ensemble reduced to the first `count` releases of each event."""
    rank = np.array([int((whole.event[:i] == e).sum()) for i, e in enumerate(whole.event)])
    kept = rank < count
    crossings = whole.crossings[kept[whole.crossings["release"]]].copy()
    crossings["release"] = (np.cumsum(kept) - 1)[crossings["release"]]
    return CrossingEnsemble(whole.stations, crossings, whole.event[kept], whole.width[kept])


def fit(samples: list[Samples], seed: int, notes: dict[str, str]) -> Network:
    """Return an ensemble of networks that are trained on samples, as one block-diagonal network.

    Raises
    ------
    BadInput
        If torch is not installed.
    """
    try:
        import torch
    except ModuleNotFoundError as error:
        hint = f"install {error.name}: pip install 'rigdda[rl]'"
        raise BadInput("model", "value", hint) from None
    features = np.concatenate([s.features for s in samples]).astype(np.float32)
    mean, scale = scaling(features)
    inputs = np.clip((features - mean) / scale, -3.0, 3.0)
    weight = np.concatenate([s.weight for s in samples])
    columns = inputs, np.concatenate([s.share for s in samples]), weight / weight.mean()
    x, y, w = (torch.tensor(column, dtype=torch.float32) for column in columns)
    members = [_member(torch, x, y, w, 100 * seed + k) for k in range(MEMBERS)]
    layers = [_block_diagonal(own) for own in zip(*members, strict=True)]
    return Network(mean, scale, layers, notes)


Layer = tuple[NDArray[np.float32], NDArray[np.float32]]


def _member(torch: Any, x: Any, y: Any, w: Any, seed: int) -> list[Layer]:
    """Return the layers of one network trained with weighted squared errors."""
    generator = torch.Generator().manual_seed(seed)
    sizes = (x.shape[1], HIDDEN, HIDDEN, 1)
    layers = []
    for before, after in itertools.pairwise(sizes):
        bound = before**-0.5
        for shape in ((after, before), (after,)):
            values = bound * (2.0 * torch.rand(shape, generator=generator) - 1.0)
            layers.append(values.requires_grad_())
    optimiser = torch.optim.AdamW(layers, lr=RATE, weight_decay=DECAY)
    steps = EPOCHS * -(-len(y) // BATCH)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    for _ in range(EPOCHS):
        order = torch.randperm(len(y), generator=generator)
        for some in order.split(BATCH):
            noise = JITTER * torch.randn((len(some), x.shape[1]), generator=generator)
            values = x[some] + noise
            for i in range(0, len(layers), 2):
                values = values @ layers[i].T + layers[i + 1]
                values = values.tanh() if i + 2 < len(layers) else values
            loss = (w[some] * (values[:, 0] - y[some]) ** 2).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    arrays = [layer.detach().numpy().astype(np.float32) for layer in layers]
    return list(zip(arrays[::2], arrays[1::2], strict=True))


def _block_diagonal(layers: tuple[Layer, ...]) -> Layer:
    """Return the layers of several networks as one; the first layers share their inputs."""
    weights = [weight for weight, _ in layers]
    bias = np.concatenate([bias for _, bias in layers])
    if weights[0].shape[1] != HIDDEN:
        return np.concatenate(weights), bias
    rows, columns = weights[0].shape
    out = np.zeros((len(weights) * rows, len(weights) * columns), dtype=np.float32)
    for k, weight in enumerate(weights):
        out[k * rows : (k + 1) * rows, k * columns : (k + 1) * columns] = weight
    return out, bias
