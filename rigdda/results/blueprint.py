"""Layout of the viewer: the slope, beside it notes and plots, below them the timeline."""

from __future__ import annotations

import rerun.blueprint as rrb

from rigdda.dynamics.run import Run
from rigdda.results.frame import frame
from rigdda.results.marks import Marks
from rigdda.results.plots import PLOTS
from rigdda.results.style import SKY

TIMELINE = "sim_time"
PLACEMENT = "placement"
"""Timeline of an episode in which barriers are placed one by one."""


def slope_view(run: Run, name: str, root: str = "") -> rrb.Spatial2DView:
    """Return the view on the slope of a run that is logged below the entity `root`."""
    left, bottom, right, top = frame(run.scene)
    return rrb.Spatial2DView(
        origin=f"{root}/world/camera",
        contents=f"{root}/world/**",
        name=name,
        background=SKY,
        visual_bounds=rrb.VisualBounds2D(x_range=(0, right - left), y_range=(0, top - bottom)),
    )


def run_blueprint(run: Run, marks: Marks) -> rrb.Blueprint:
    """Return the layout: the slope, beside it the notes and the plots."""
    slope = slope_view(run, marks.title)
    plots = {
        name: rrb.TimeSeriesView(
            origin=f"/plots/{name}",
            name=title,
            axis_y=rrb.ScalarAxis(range=(0.0, 1.05)) if name == "debris" else None,
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for name, (title, _) in PLOTS.items()
    }
    debris = plots.pop("debris")
    side: list[rrb.Container | rrb.View] = [
        plots.pop("kinetic_energy"),
        rrb.Tabs(*plots.values()),
    ]
    if marks.road is not None:
        side = [debris, *side]
    notes = rrb.TextDocumentView(origin="/notes", name="episode")
    column = rrb.Vertical(notes, *side, row_shares=[1.4] + [1.0] * len(side))
    return rrb.Blueprint(
        rrb.Horizontal(slope, column, column_shares=[5, 2]),
        rrb.TimePanel(timeline=TIMELINE, play_state="playing", loop_mode="all", state="collapsed"),
        collapse_panels=True,
    )
