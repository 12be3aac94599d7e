"""Tschamut 2014: run-outs of repeated tests, predicted after a fit to some of them.

Three blocks were released repeatedly on a slope of grass and soil (Volkwein and Gerber 2018, doi
10.16904/envidat.34, ODbL). `site.toml` describes the slope with the blocks by their measured edges,
and `observed.csv` contains 33 of the runs. The block model and the lumped-mass model are fitted to
them in the same way as by `rigdda fit`, with four parameters and the same budget each. Each
observed run is predicted by the best fit to the others. The prediction of unpublished runs, 1,000
per block, uses the ground `meadow` of the library, which was fitted to these runs and to the
contacts at Chant Sura (`experiments.grounds`). PlatRock is fitted with the same budget if
`PLATROCK_PYTHON` names a Python with PlatRock, see `platrock`. Its spheres have the volumes of the
blocks, drop by 0.1 to 0.3 m and start at the mean speed of the blocks.

Judged by the error of the mean predicted run-out of left-out runs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.script import BLUE, GREEN, GREY, ORANGE, RED, Number, draw, interval, say, write
from experiments.tschamut.platrock import PARAMETERS, PYTHON, PlatRock
from rigdda import Site, release
from rigdda.app.uncertainty import fit, observations
from rigdda.app.uncertainty.fit import Fit, Floats, seen
from rigdda.app.uncertainty.parameters import Parameter, parse, with_values

HERE = Path(__file__).parent

MODELS: dict[fit.Model, tuple[str, ...]] = {
    "blocks": (
        "surfaces.soil.friction_deg=15:65",
        "surfaces.soil.restitution=0:0.8",
        "surfaces.soil.rolling=0:0.6",
        "surfaces.soil.friction_sd_deg=0:10",
    ),
    "lumped": (
        "lumped.soil.normal=0:0.8",
        "lumped.soil.tangential=0.4:1",
        "lumped.soil.friction_deg=15:65",
        "scatter.friction_deg=0:10",
    ),
}
"""Fitted parameters of each model."""

COLOURS = {"blocks": BLUE, "lumped": GREEN, "PlatRock": ORANGE}

BUDGET, QUICK_BUDGET = 192, 16
"""Number of parameter sets that are computed for each model."""

RELEASES, QUICK_RELEASES = 250, 40
"""Releases of each block with each set."""

PREDICTED, QUICK_PREDICTED = 1000, 100
"""Releases of each block with the fitted values, with fresh seeds."""

FRESH = 1_000_000
"""First of the fresh seeds."""

DRAWN = 25
"""Trajectories of each block in the picture."""

STARTED = 5.0
"""Least run-out of a release that counts as started [m]."""

SPARE = 1.4
"""Releases computed per release needed, since some do not start."""

BAR = 5.0
"""Tolerance of the mean run-out [m]."""


def runs(site: Site, model: fit.Model, events: Sequence[str], seeds: range) -> dict[str, Floats]:
    """Return the computed run-outs of the releases that start [m], by block.

    A block that stays where it was placed is not a run of the tests. Up to one in ten releases of a
    plate lying flat on a slope below its friction angle does not start.
    """
    found = fit.run_outs(site, model, events, seeds)
    started = {event: values[values > STARTED] for event, values in found.items()}
    return {event: started[event] if len(started[event]) else found[event] for event in found}


def table(model: str, fitted: Fit, observed: dict[str, Floats], seconds: float) -> list[dict]:
    """Return rows as `rigdda.app.uncertainty.fit.rows` does, with model and processor time [s]."""
    return [{"model": model, "cpu_s": seconds} | row for row in fit.rows(fitted, observed)]


def behind(model: str, left_out: Floats, blocks: Floats, seconds: float) -> dict[str, Any]:
    """Return the row with the difference of a model's left-out scores from those of the blocks."""
    mean, half = interval(left_out - blocks)
    return {
        "model": model, "cpu_s": seconds, "what": "score of a run over that of blocks",
        "unit": "m", "low": mean - half, "high": mean + half, "left_out": mean,
    }  # fmt: skip


def cumulative(axes: Axes, values: Floats, colour: str, words: str, band: int = 0) -> None:
    """Draw the share of runs that stop before a chainage, with a 95 % band for `band` runs."""
    grid = np.linspace(0.0, 160.0, 400)
    share = (values[:, None] <= grid).mean(axis=0)
    axes.plot(grid, share, color=colour, label=words)
    if band:
        half = 1.96 * np.sqrt(share * (1.0 - share) / band)
        low, high = np.clip([share - half, share + half], 0.0, 1.0)
        axes.fill_between(grid, low, high, color=colour, alpha=0.2, lw=0)


def picture(
    figure: Figure,
    observed: dict[str, Floats],
    predicted: dict[str, dict[str, Floats]],
    site: Site,
) -> None:
    """Draw cumulative run-outs of all runs and of each block, and a section with trajectories."""
    above, below = figure.subfigures(2, 1, squeeze=False)[:, 0]
    names = ("all", *observed)
    for axes, name in zip(above.subplots(1, len(names), sharey=True), names, strict=True):
        events = list(observed) if name == "all" else [name]
        real = np.concatenate([observed[e] for e in events])
        for model in predicted:
            colour = COLOURS[model]
            values = np.concatenate([predicted[model][e] for e in events])
            cumulative(axes, values, colour, model, len(real) if model == "blocks" else 0)
        order = np.arange(1, len(real) + 1) / len(real)
        axes.step(np.sort(real), order, where="post", color=RED, label=f"observed, {len(real)}")
        axes.set(title=name, xlabel="run-out [m]", ylim=(0.0, 1.0))
        axes.legend(loc="upper left", fontsize=8)
    axes = below.subplots()
    x, y = site.profile.points.T
    axes.plot(x, y, color=GREY)
    for event, colour in zip(observed, (BLUE, GREEN, RED), strict=True):
        for seed in range(DRAWN):
            run, _ = release(site, (), FRESH + seed, event)
            words = event if seed == 0 else None
            axes.plot(*run.poses[:, 0, :2].T, color=colour, lw=0.5, alpha=0.6, label=words)
    axes.set(xlim=(-10.0, 150.0), ylim=(y.min() - 3.0, y.max() + 3.0), aspect="equal")
    axes.set(xlabel="chainage [m]", ylabel="elevation [m]")
    axes.legend()


def predict(path: Path, site: Site, events: Sequence[str], count: int) -> None:
    """Write the predictions with the ground `meadow` of the library, `count` runs of each block."""
    drawn = runs(site, "blocks", events, range(FRESH, FRESH + round(SPARE * count)))
    rows = [
        {"block": event.removeprefix("block "), "run_out_m": float(x)}
        for event, values in drawn.items()
        for x in values[:count]
    ]
    write(path, rows)


def observed_run_outs(path: Path, site: Site) -> dict[str, Floats]:
    """Return the observed run-outs of each event in a CSV file [m]."""
    return {one.event: one.values for one in observations.read([path], site).values()}


def run(quick: bool, out: Path) -> Number:
    """Fit the models, predict, and write the tables and the picture."""
    site = Site.load(HERE / "site.toml")
    observed = observed_run_outs(HERE / "observed.csv", site)
    budget, releases, count = (
        (QUICK_BUDGET, QUICK_RELEASES, QUICK_PREDICTED) if quick else (BUDGET, RELEASES, PREDICTED)
    )
    rows: list[dict[str, Any]] = []
    predicted, found = dict[str, dict[str, Floats]](), dict[str, Fit]()
    seeds = range(FRESH, FRESH + count)

    def tell(model: str) -> Callable[[int, str], None]:
        def tick(done: int, words: str) -> None:
            if done % 16 == 0:
                say(f"tschamut: {model}, {done} of {budget}, {words}")

        return tick

    for model, names in MODELS.items():
        start = time.process_time()
        parameters = [parse(name) for name in names]

        def compute(
            values: Floats,
            seeds: range,
            of: Sequence[Parameter] = parameters,
            by: fit.Model = model,
        ) -> dict[str, Floats]:
            return runs(with_values(site, of, list(values)), by, list(observed), seeds)

        fitted = fit.search(site, observed, parameters, compute, budget, releases, 0, tell(model))
        values = list(fitted.best.values)
        found[model] = fitted._replace(site=with_values(site, parameters, values))
        seconds = time.process_time() - start
        rows += table(model, found[model], observed, seconds)
        if model != "blocks":
            lost = found["blocks"].left_out
            rows.append(behind(model, found[model].left_out, lost, seconds))
        more = range(FRESH, FRESH + round(SPARE * count))
        drawn = runs(found[model].site, model, list(observed), more)
        predicted[model] = {event: values[:count] for event, values in drawn.items()}
    if os.environ.get(PYTHON):
        try:
            with PlatRock(os.environ[PYTHON], site) as peer:
                fitted = fit.search(
                    site, observed, PARAMETERS, peer.run_outs, budget, releases, 0, tell("PlatRock")
                )
                rows += table("PlatRock", fitted, observed, peer.cpu)
                lost = found["blocks"].left_out
                rows.append(behind("PlatRock", fitted.left_out, lost, peer.cpu))
                predicted["PlatRock"] = dict(peer.run_outs(fitted.best.values, seeds))
                found["PlatRock"] = fitted
        except RuntimeError as failure:  # keep the results of the other models
            say(f"tschamut: {failure}")
    write(out / "tschamut" / "tschamut.csv", rows)
    predict(out / "tschamut" / "prediction.csv", site, list(observed), count)
    slope = found["blocks"].site
    path = out / "tschamut" / "tschamut.png"
    draw(path, (12.0, 7.5), lambda figure: picture(figure, observed, predicted, slope))
    real = seen(observed, site.slope.toe)
    error = {model: abs(each.validated.mean - real.mean) for model, each in found.items()}
    note = ", ".join(f"{model} {off:.1f} m" for model, off in error.items() if model != "blocks")
    return Number("error of the mean run-out of left-out runs [m]", error["blocks"], 0.0, BAR, note)
