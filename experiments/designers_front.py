"""Cost against debris: the front of NSGA-II from the other designers' layouts, and where these lie.

`python -m experiments.designers_front [--quick] [--site NAME] [--out DIR]`, at fidelity "fast".
Each searches with the same budget, NSGA-II after the others. Whatever is shown was verified on the
same releases, that no designer has seen; of its finalists the front is what none there dominates.

Writes front.csv and front.png and says whether another designer's layout dominates the front:
cheaper than one of its points and, intervals apart, safer. Goes on where it was stopped.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from agents import pareto, pictures
from agents.store import Store
from agents.tables import write_rows
from agents.terminal import progress
from agents.verify import verify
from envs import DesignProblem, Evaluation, fidelity
from experiments.designers import contestants
from rigdda import Site

RESULTS = Path("experiments/results/designers")
OTHERS = ("rule", "convex", "cma", "tpe", "policy")


def dominates(one: Evaluation, other: Evaluation) -> bool:
    """Return whether a layout is no dearer than another and safer, intervals apart."""
    return one.cost <= other.cost and one.debris_ci[1] < other.debris_ci[0]


def dominated(front: Sequence[Evaluation], points: dict[str, Evaluation]) -> list[str]:
    """Return the designers."""
    return [name for name, e in points.items() if any(dominates(e, f) for f in front)]


@click.command()
@click.option("--quick", is_flag=True, help="Minutes: 120 simulations, 8 to verify.")
@click.option("--site", default="shu-hwa", show_default=True, help="A name or a TOML file.")
@click.option("--simulations", default=800, show_default=True, help="Releases of a search.")
@click.option("--verify", "unseen", default=256, show_default=True, help="Unseen releases.")
@click.option("--out", type=click.Path(path_type=Path), help=f"Folder to write into: {RESULTS}.")
def main(quick: bool, site: str, simulations: int, unseen: int, out: Path | None) -> None:
    """Draw the front, see the module."""
    if quick:
        simulations, unseen = min(simulations, 120), 8
    folder = out or (RESULTS / "quick" if quick else RESULTS)
    posed = DesignProblem(fidelity.at(Site.load(site), "fast"))
    (folder / "evaluations").mkdir(parents=True, exist_ok=True)
    store = Store(folder / "evaluations" / f"front-{posed.site.name}.jsonl")
    points: dict[str, Evaluation] = {}
    with progress(len(OTHERS) + 1) as tick:
        for done, (name, design) in enumerate(contestants(OTHERS).items()):
            tick(done, name)
            layout = design(posed, simulations, 0, None, store).layout
            points[name] = verify(posed, layout, unseen, 0, store)
        tick(len(OTHERS), "pareto")
        known = [e.layout for e in points.values()]
        found = pareto.warm_started(posed, known, simulations, 0, None, store)
        ends = [entry.evaluation.layout for entry in found.history.stage("final")]
        front = pareto.front(verify(posed, layout, unseen, 0, store) for layout in ends)
    rows = [("front", e) for e in front] + list(points.items())
    write_rows(folder / "front.csv", [
        {"designer": name, "cost": e.cost, "debris": e.debris, "debris_low": e.debris_ci[0],
         "debris_high": e.debris_ci[1], "objective": e.objective} for name, e in rows
    ])  # fmt: skip
    pictures.front(folder / "front.png", found.history, front, list(points.items()))
    behind = ", ".join(dominated(front, points)) or "no designer"
    click.echo(f"{posed.site.name}: {len(front)} points; dominated by {behind}")


if __name__ == "__main__":
    main()
