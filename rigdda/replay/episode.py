"""Replays of episodes that place barriers one by one and show the same release after each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from rigdda.errors import BadInput
from rigdda.replay.recording import (
    PLACEMENT,
    TIMELINE,
    Marks,
    RecordedMotion,
    log_record,
    log_run,
    recording,
    slope_view,
)


@dataclass(frozen=True, slots=True)
class Placement:
    """State of an episode after one placement.

    Parameters
    ----------
    run : Run
        The release with the current barriers.
    layout : str
        Description of the current barriers.
    reward, objective, debris, cost : float
        Values of the placement; at the start, without barriers, the reward is 0.
    """

    run: RecordedMotion
    layout: str
    reward: float
    objective: float
    debris: float
    cost: float


NUMBERS = ("reward", "objective", "debris", "cost")


def write_episode(
    path: str | os.PathLike[str],
    placements: Sequence[Placement],
    road: tuple[float, float],
    seed: str,
    title: str,
    record: str = "",
) -> None:
    """Write an episode as a Rerun recording.

    Placement k, where 0 is the start without barriers, is below the entity `placement_k`, with its
    frames on the timelines `sim_time` and `placement`. The layout and the values after each
    placement are below `episode` on the timeline `placement`.

    Parameters
    ----------
    path : path
        The .rrd file; an existing one is replaced when the new one is complete.
    placements : sequence of Placement
        The start, without barriers, and the placements.
    road : (float, float)
        Chainages of the road's uphill and downhill edges [m].
    seed : str
        Description of the seed of the release.
    title : str
        Name of the recording.
    record : str
        All inputs needed to compute the episode again, as JSON; stored in the file but not shown.

    Raises
    ------
    BadInput
        If there are no placements or the file name does not end in .rrd.
    """
    if not placements:
        raise BadInput("placements", placements, "give at least the start")
    with recording(path, _blueprint(placements)) as rec:
        rec.send_recording_name(title)
        for k, placement in enumerate(placements):
            notes = {name: f"{getattr(placement, name):.4f}" for name in NUMBERS}
            marks = Marks(road, {"layout": placement.layout, **notes}, _name(k))
            log_run(rec, placement.run, marks, _root(k), k)
            rec.set_time(PLACEMENT, sequence=k)
            rec.log("episode/layout", rr.TextDocument(placement.layout))
            for name in NUMBERS:
                rec.log(f"episode/{name}", rr.Scalars(getattr(placement, name)))
        page = rr.TextDocument(_words(placements, seed, title), media_type="text/markdown")
        rec.log("notes", page, static=True)
        log_record(rec, record)


def _root(k: int) -> str:
    return f"/placement_{k}"


def _name(k: int) -> str:
    return f"placement {k}" if k else "no barrier"


def _words(placements: Sequence[Placement], seed: str, title: str) -> str:
    """Return a description of the whole episode in Markdown, with a table."""
    lines = [f"## {title}", "", f"**seed**: {seed}", ""]
    lines += ["| | reward | objective | debris | cost | layout |", "|-|-|-|-|-|-|"]
    for k, p in enumerate(placements):
        numbers = f"{p.reward:+.4f} | {p.objective:.4f} | {p.debris:.4f} | {p.cost:.2f}"
        lines.append(f"| {k} | {numbers} | {p.layout} |")
    return "\n".join(lines)


def _blueprint(placements: Sequence[Placement]) -> rrb.Blueprint:
    """Return the viewer layout: a tab with the slope for each placement, and notes at the side."""
    views = [slope_view(p.run, _name(k), _root(k)) for k, p in enumerate(placements)]
    debris = [
        rrb.TimeSeriesView(
            origin=f"{_root(k)}/plots/debris",
            name=f"debris, {_name(k)}",
            axis_y=rrb.ScalarAxis(range=(0.0, 1.05)),
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for k in range(len(placements))
    ]
    notes = rrb.TextDocumentView(origin="/notes", name="episode")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Tabs(*views, active_tab=len(views) - 1),
            rrb.Vertical(notes, *debris, row_shares=[2.0] + [1.0] * len(debris)),
            column_shares=[5, 2],
        ),
        rrb.TimePanel(timeline=TIMELINE, play_state="playing", loop_mode="all", state="collapsed"),
        collapse_panels=True,
    )
