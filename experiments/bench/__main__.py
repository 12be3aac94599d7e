"""Run the benchmark: `python -m experiments.bench [--quick] [--out DIR]`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import click
from rich.console import Console

from experiments.bench import footprint, growth, pictures, tables, throughput
from experiments.bench.cases import all_cases, quick_cases
from experiments.bench.engines import PeerMissing, load
from experiments.bench.levels import CORE, levels
from experiments.bench.timing import FULL, QUICK, Setting, sweep

RESULTS = Path("experiments/results/bench")


def best(settings: list[Setting], error: float, core: bool) -> Setting | None:
    """Return the cheapest setting of this core, or of the peers, with at most this error."""
    good = [s for s in settings if s.error <= error and (s.engine.NAME == CORE) is core]
    return min(good, key=lambda s: s.median, default=None)


def compare(console: Console, out: Path, quick: bool, say: Callable[[str], None]) -> None:
    """Run all engines on all cases, and measure the throughput with the settings found."""
    cases = quick_cases() if quick else all_cases()
    found = {c.name: sweep(c, load(), QUICK if quick else FULL, say) for c in cases}
    rows = [s.row(c) for c in cases for s in found[c.name]]
    tables.write(out / "settings.csv", rows)
    pictures.fronts(out / "fronts.png", cases, rows)
    table = levels(cases, rows)
    tables.write(out / "levels.csv", table)
    tables.show_levels(console, table)
    small = next(c for c in cases if c.name == "rockfall-20")
    ours, theirs = (best(found[small.name], small.levels[0], core) for core in (True, False))
    if ours and theirs:
        say("episodes a second")
        rate = throughput.measure(small, ours, theirs, 16 if quick else 48, 1 if quick else 5)
        tables.write(out / "throughput.csv", [rate])
        tables.show(console, "Episodes of 20 blocks", rate)


def alone(console: Console, out: Path, quick: bool, say: Callable[[str], None]) -> None:
    """Measure properties of this core alone: growth of cost, start-up time and memory."""
    sizes = growth.SIZES[:5] if quick else growth.SIZES
    piles = growth.measure(sizes, 1 if quick else 2, say)
    tables.write(out / "growth.csv", piles)
    pictures.growth(out / "growth.png", piles)
    tables.show_rows(console, f"Growth: blocks^{growth.exponent(piles):.2f}", piles)
    say("start-up and memory")
    used = footprint.measure(cold=not quick)
    tables.write(out / "footprint.csv", [used])
    tables.show(console, "Start-up and memory", used)


@click.command()
@click.option("--quick", is_flag=True, help="Use fewer steps, releases and blocks (ten minutes).")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help=f"Folder for CSV files and pictures; default {RESULTS}.",
)
def main(quick: bool, out: Path | None) -> None:
    """Benchmark this core and the peers pymunk, Box2D v3 and MuJoCo on the same scenes."""
    console = Console(width=None if sys.stdout.isatty() else 160)
    out = out or (RESULTS / "quick" if quick else RESULTS)

    def say(what: str) -> None:
        print(what, file=sys.stderr, flush=True)

    try:
        load()
    except PeerMissing as error:
        raise click.ClickException(str(error)) from None
    out.mkdir(parents=True, exist_ok=True)
    compare(console, out, quick, say)
    alone(console, out, quick, say)


if __name__ == "__main__":
    main()
