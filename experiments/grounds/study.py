"""One set of ground parameters compared with three field cases: fitted to one, predicting others.

The cases are the run-outs of 33 tests at Tschamut (`experiments.tschamut`), eleven contacts with
the ground at Chant Sura (`experiments.grounds.contacts`) and the catch bench of a mine
(`experiments.catch_bench`). Four parameters of the ground are fitted to each case in turn, with the
block model and the lumped-mass model, and to the two cases on alpine soil together; the other cases
are predicted. `chant_sura/predicted_contacts.csv` contains predictions with the ground `meadow` of
the library for contacts that were not used in any fit.

Judged by the mean share of energy kept in contacts, predicted by the fit to Tschamut alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import msgspec
import numpy as np
from matplotlib.figure import Figure

from experiments import tschamut
from experiments.catch_bench.study import FITTED, PREDICTED, below, within
from experiments.grounds import contacts, reach
from experiments.grounds.contacts import MASSES, early_contacts, lumped_share, mid_slope, observed
from experiments.grounds.reach import SLOWED_AT
from experiments.script import BLUE, GREEN, GREY, ORANGE, RED, Number, draw, say, write
from experiments.tschamut.study import observed_run_outs, runs
from rigdda import Site, Surface
from rigdda.app.uncertainty import fit
from rigdda.app.uncertainty.fit import Floats, explore, scores
from rigdda.ground.grounds import GROUNDS
from rigdda.model.site_tables import Rebound, Scatter

TSCHAMUT = Path(tschamut.__file__).parent

FACE = 75.0
"""Assumed angle of the face above the catch bench [deg]."""

RANGES = {
    "blocks": {
        "friction_deg": (25.0, 62.0),
        "restitution": (0.0, 0.8),
        "rolling": (0.0, 0.6),
        "friction_sd_deg": (0.0, 8.0),
    },
    "lumped": {
        "normal": (0.0, 0.8),
        "tangential": (0.4, 1.0),
        "friction_deg": (15.0, 62.0),
        "friction_sd_deg": (0.0, 8.0),
    },
}
"""Fitted parameters of each model and their ranges."""

BUDGET, QUICK_BUDGET = 192, 16
"""Number of parameter sets that are computed for each fit."""

RELEASES, QUICK_RELEASES = 120, 30
"""Releases of each block with each set."""

PREDICTED_RELEASES, QUICK_PREDICTED = 1000, 60
"""Releases of each block for a prediction, with fresh seeds."""

FRESH = 1_000_000
"""First of the fresh seeds."""

BAR = 0.15
"""Tolerance of the mean share kept in contacts [-]."""


class Found(NamedTuple):
    """Results of a ground in each case."""

    run_outs: dict[str, Floats]
    """Run-outs at Tschamut by block [m]."""
    shares: Floats
    """Shares of energy kept in the first contacts [-]."""
    widths: Floats
    """Distances from the toe at which blocks stop on the mine bench [m]."""


class Field:
    """The three cases, and the misfit of a ground in each.

    Parameters
    ----------
    model : {"blocks", "lumped"}
        The model.
    fixed : mapping, optional
        Values of the ground of the block model that are not fitted. By default, restitution falls
        with the speed of impact.
    """

    def __init__(
        self,
        model: fit.Model,
        fixed: Mapping[str, Any] = MappingProxyType({"restitution_speed": SLOWED_AT}),
    ):
        self.model, self.fixed = model, fixed
        self.slope = Site.load(TSCHAMUT / "site.toml")
        self.seen = observed_run_outs(TSCHAMUT / "observed.csv", self.slope)
        self.bench = below(FACE)
        self.kept = observed()[:, 2]
        self.names = tuple(name for name in RANGES[model] if name not in fixed)
        self.low, self.high = np.array([RANGES[model][name] for name in self.names]).T

    def ground(self, values: Floats) -> Surface:
        """Return the ground of the block model with these values."""
        return Surface(**dict(zip(self.names, values.tolist(), strict=True)), **self.fixed)

    def site(self, site: Site, surface: str, values: Floats) -> Site:
        """Return a site with a ground of these values."""
        if self.model == "blocks":
            surfaces = site.surfaces | {surface: self.ground(values)}
            return msgspec.structs.replace(site, surfaces=surfaces, scatter=Scatter())
        named = dict(zip(self.names, values.tolist(), strict=True))
        scatter = Scatter(named.pop("friction_sd_deg"))
        lumped = {surface: Rebound(**named)}
        return msgspec.structs.replace(site, lumped=lumped, scatter=scatter)

    def tschamut(self, values: Floats, seeds: range) -> dict[str, Floats]:
        """Return the run-outs at Tschamut by block [m]."""
        site = self.site(self.slope, "soil", values)
        return runs(site, self.model, list(self.seen), seeds)

    def contacts(self, values: Floats, seeds: range) -> Floats:
        """Return the shares of energy kept in contacts at Chant Sura [-]."""
        if self.model == "lumped":
            return lumped_share(values[0], values[1])
        return shares(self.ground(values), len(seeds), seeds.start)

    def widths(self, values: Floats, seeds: range) -> Floats:
        """Return the distances from the toe at which blocks stop on the mine bench [m]."""
        site = self.site(self.bench, "rock", values)
        (found,) = fit.run_outs(site, self.model, ["block"], seeds).values()
        return found - site.slope.toe

    def misfit(self, case: str, values: Floats, seeds: range) -> float:
        """Return the misfit of a ground in a case, over that of the observations themselves [-].

        For run-outs and shares, this is the ratio of continuous ranked probability scores.
        """
        if case == "catch bench":
            found = self.widths(values, range(seeds.start, seeds.start + 3 * len(seeds)))
            off = [within(found, width) - share for width, share in (FITTED, PREDICTED)]
            return math.hypot(*off) / 0.1
        if case == "chant sura":
            own = scores(self.kept, self.kept).mean()
            return float(scores(self.contacts(values, seeds), self.kept).mean() / own)
        run_outs = self.tschamut(values, seeds)
        each = np.concatenate([scores(run_outs[e], self.seen[e]) for e in self.seen])
        least = np.concatenate([scores(self.seen[e], self.seen[e]) for e in self.seen])
        return float(each.mean() / least.mean())

    def fit(self, cases: tuple[str, ...], budget: int, releases: int) -> Floats:
        """Return the values with the best fit to some cases, each weighted by its observations."""
        weights = {"tschamut": sum(map(len, self.seen.values())), "chant sura": len(self.kept)}
        tried: list[tuple[float, Floats]] = []

        def score(place: Floats) -> float:
            values = self.low + (self.high - self.low) * np.clip(place, 0.0, 1.0)
            seeds = range(releases)
            parts = [weights.get(c, 1) * self.misfit(c, values, seeds) for c in cases]
            tried.append((sum(parts), values))
            return tried[-1][0]

        explore(score, len(self.names), budget, 0)
        tried.sort(key=lambda pair: pair[0])
        fresh = range(releases, 5 * releases)
        again = [
            sum(weights.get(c, 1) * self.misfit(c, values, fresh) for c in cases)
            for _, values in tried[:8]
        ]
        return tried[int(np.argmin(again))][1]


def shares(surface: Surface, count: int, seed: int, number: int = 1) -> Floats:
    """Return the shares of energy kept in the first contacts of all blocks, or in later ones."""
    each = (early_contacts(surface, name, count, seed, number) for name in MASSES)
    return np.array([contact.kept for found in each for contact in found])


FITS: tuple[tuple[str, ...], ...] = (
    ("tschamut",),
    ("chant sura",),
    ("catch bench",),
    ("tschamut", "chant sura"),
)
"""Cases of each fit."""


def row(field: Field, fitted: str, values: Floats, count: int) -> tuple[dict[str, Any], Found]:
    """Return the row of a fit, and its results with fresh seeds."""
    seeds = range(FRESH, FRESH + count)
    found = Found(
        field.tschamut(values, seeds), field.contacts(values, seeds), field.widths(values, seeds)
    )
    out: dict[str, Any] = {"model": field.model, "fitted_on": fitted}
    out |= {name: "" for names in RANGES.values() for name in names}
    out |= dict(zip(field.names, values.tolist(), strict=True))
    weights = {e: len(field.seen[e]) / len(found.run_outs[e]) for e in field.seen}
    out |= tschamut_figures(found.run_outs, weights, field.slope.slope.toe)
    out |= {
        "contacts_mean": found.shares.mean(),
        "contacts_median": float(np.median(found.shares)),
        "second_contacts_mean": "",
        "mid_slope_mean": "",
        "mid_slope_median": "",
    }
    if field.model == "blocks":
        surface = field.ground(values)
        out["second_contacts_mean"] = shares(surface, max(count // 5, 6), FRESH, 2).mean()
        kept = [c.kept for c in mid_slope(surface, max(count // 10, 6), FRESH)]
        if kept:
            out |= {"mid_slope_mean": np.mean(kept), "mid_slope_median": float(np.median(kept))}
    out |= {f"within_{w:g}_m": within(found.widths, w) for w, _ in (FITTED, PREDICTED)}
    return out, found


def tschamut_figures(
    found: dict[str, Floats], weights: dict[str, float], toe: float
) -> dict[str, float]:
    """Return mean, quantiles, block means and share on the slope of weighted releases."""
    values = np.concatenate([found[e] for e in found])
    weight = np.concatenate([np.full(len(found[e]), weights[e]) for e in found])
    weight /= weight.sum()
    order = np.argsort(values)
    below_share = np.cumsum(weight[order])
    out = {"run_out_mean_m": float(values @ weight)}
    for share in (0.05, 0.5, 0.95):
        at = values[order][min(int(np.searchsorted(below_share, share)), len(values) - 1)]
        out[f"run_out_{100 * share:.0f}_m"] = float(at)
    out |= {f"{e.replace(' ', '_')}_m": float(found[e].mean()) for e in found}
    return out | {"stops_on_slope": float(weight[values <= toe].sum())}


def seen_row(field: Field) -> dict[str, Any]:
    """Return the row of the observations."""
    ones = dict.fromkeys(field.seen, 1.0)
    empty = {name: "" for names in RANGES.values() for name in names}
    return (
        {"model": "observed", "fitted_on": ""}
        | empty
        | tschamut_figures(field.seen, ones, field.slope.slope.toe)
        | {
            "contacts_mean": field.kept.mean(),
            "contacts_median": float(np.median(field.kept)),
            "second_contacts_mean": "",
            "mid_slope_mean": contacts.MID_SLOPE.mean(),
            "mid_slope_median": float(np.median(contacts.MID_SLOPE)),
        }
        | {f"within_{width:g}_m": share for width, share in (FITTED, PREDICTED)}
    )


COLOURS = (BLUE, GREEN, ORANGE, GREY)


def picture(figure: Figure, field: Field, every: dict[str, Found]) -> None:
    """Draw the results of each fit of the block model in each case, with the observations."""
    axes = figure.subplots(1, 3)
    seen = (np.concatenate(list(field.seen.values())), field.kept, None)
    for panel, (axis, real) in enumerate(zip(axes, seen, strict=True)):
        for (fitted, found), colour in zip(every.items(), COLOURS, strict=False):
            values = (
                np.concatenate([found.run_outs[e] for e in field.seen]),
                found.shares,
                found.widths,
            )[panel]
            order = np.sort(values)
            axis.plot(order, np.arange(1, len(order) + 1) / len(order), color=colour,
                      label=f"fitted on {fitted}")  # fmt: skip
        if real is not None:
            steps = np.arange(1, len(real) + 1) / len(real)
            axis.step(np.sort(real), steps, where="post", color=RED, label=f"observed, {len(real)}")
        axis.set_ylim(0.0, 1.0)
    axes[2].plot(*np.array([FITTED, PREDICTED]).T, "o", color=RED, label="calibrated model")
    axes[0].set(title="Tschamut", xlabel="run-out [m]", ylabel="share of releases", xlim=(0, 200))
    axes[1].set(title="Chant Sura", xlabel="share of energy that a contact keeps", xlim=(0, 1.2))
    axes[2].set(title="catch bench", xlabel="width from the toe [m]", xlim=(0, 40))
    for axis in axes:
        axis.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.18))


def predict(path: Path, count: int) -> None:
    """Write the contacts predicted with the library's meadow, `count` releases of each block."""
    surface = Surface(ground="meadow")
    rows = [
        {"block": name, "speed_m_s": c.speed, "share_kept": c.kept}
        for name in MASSES
        for c in early_contacts(surface, name, count, FRESH)
    ]
    write(path, rows)


def run(quick: bool, out: Path) -> Number:
    """Fit, predict, and write the tables and the picture."""
    budget = QUICK_BUDGET if quick else BUDGET
    releases = QUICK_RELEASES if quick else RELEASES
    count = QUICK_PREDICTED if quick else PREDICTED_RELEASES
    rows: list[dict[str, Any]] = []
    every: dict[str, Found] = {}
    fields: dict[str, Field] = {}
    for model in ("blocks", "lumped"):
        field = fields[model] = Field(model)
        for cases in FITS:
            fitted = " and ".join(cases)
            say(f"grounds: {model}, fitted on {fitted}")
            values = field.fit(cases, budget, releases)
            found_row, found = row(field, fitted, values, count)
            rows.append(found_row)
            if model == "blocks":
                every[fitted] = found
    field = fields["blocks"]
    library = np.array([getattr(GROUNDS["meadow"], name).typical for name in field.names[:3]])
    values = np.array([*library, GROUNDS["meadow"].friction_sd_deg])
    rows.append(row(field, "the library: meadow", values, count)[0])
    rows.append(seen_row(field))
    write(out / "grounds.csv", rows)
    predict(out / "chant_sura" / "predicted_contacts.csv", count)
    say("grounds: effect of parameters on a slope with talus")
    write(out / "grounds_reach.csv", reach.rows(count))
    draw(out / "grounds.png", (13.0, 5.0), lambda figure: picture(figure, field, every))
    by_tschamut, real = rows[0]["contacts_mean"], rows[-1]["contacts_mean"]
    note = ", ".join(
        f"{r['model']} fitted on {r['fitted_on']} {r['contacts_mean']:.2f}" for r in rows[1:-1]
    )
    return Number(
        "mean share of energy kept in contacts, by the fit to Tschamut [-]",
        by_tschamut,
        real - BAR,
        real + BAR,
        note,
    )
