"""Pictures of a release: slope, road, barriers and blocks. Matplotlib is imported on use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigdda import Run
from rigdda.barriers import Earthwork

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = (8.0, 4.5)
"""Width and height of a picture [inch], 100 pixels each."""
GROUND, ROCK, BARRIER, ROAD = "#c9bca5", "#68584a", "#1c5aa0", "#e85d04"
BROKEN = "#b0b6bc"


def draw(axes: Axes, run: Run, road: tuple[float, float], frame: int = -1) -> None:
    """Draw one frame of a run into axes, in metres and to scale.

    Parameters
    ----------
    axes : matplotlib axes
        Where to draw.
    run : Run
        A release on a slope.
    road : (float, float)
        Chainages of the road's uphill and downhill edge [m].
    frame : int
        Index of the frame, the last by default.
    """
    terrain = run.ground
    assert terrain is not None
    x, y = terrain.points.T
    for i, barrier in enumerate(run.scene.barriers):
        colour = BARRIER if run.times[frame] < run.failure(i) else BROKEN
        axes.fill(
            *run.outline(i, frame).T,
            facecolor="none" if barrier.drawn == "line" else colour,
            edgecolor=colour,
            linewidth=1.0 if barrier.drawn == "line" else 0.0,
            zorder=3.0 if isinstance(barrier, Earthwork) else 1.0,
        )
    axes.fill_between(x, y, y.min() - 0.05 * np.ptp(y), color=GROUND, linewidth=0)
    inner = x[(x > road[0]) & (x < road[1])]
    lane = [road[0], *inner, road[1]]
    axes.plot(lane, [terrain.height(at) for at in lane], color=ROAD, linewidth=4)
    for i in range(len(run.scene.blocks)):
        axes.fill(*_corners(run, frame, i).T, color=ROCK, edgecolor="white", linewidth=0.2)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def picture(run: Run, road: tuple[float, float], title: str) -> NDArray[np.uint8]:
    """Return the last frame of a run as an RGB image, (450, 800, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(SIZE, dpi=100, layout="constrained")  # unknown to pyplot: nothing to close
    canvas = FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw(axes, run, road)
    axes.set_title(title)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _corners(run: Run, frame: int, block: int) -> NDArray[np.float64]:
    """Return the (n, 2) corners of a block in a frame; the first frame is turned by 0."""
    x, y, theta = run.poses[frame, block]
    cos, sin = np.cos(theta), np.sin(theta)
    turn = np.array([[cos, -sin], [sin, cos]])
    return (run.scene.blocks[block].vertices - run.poses[0, block, :2]) @ turn.T + [x, y]
