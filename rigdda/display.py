"""Display of objects in notebooks: images of slope sections and HTML tables.

`Site`, `Run`, `Evaluation` and `DesignResult` have `_repr_png_` or `_repr_html_` methods, which
notebooks call; this module has the code that they share. Matplotlib is imported on first use.
"""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

IMAGE_WIDTH = 8.0
"""Width of an image [inch], at 100 pixels per inch."""

LEAST_IMAGE_HEIGHT, GREATEST_IMAGE_HEIGHT = 2.6, 5.5
"""Minimum and maximum height of an image [inch], which otherwise follows from the shape of the
section."""

GROUND, ROCK, BARRIER, ROAD, ZONE = "#c9bca5", "#68584a", "#1c5aa0", "#e85d04", "#9dc3e6"
"""Colours of all images of slopes."""

OLD = "#8a7f9e"
"""Colour of barriers that stand already, whose outlines are dashed."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A barrier in an image.

    Parameters
    ----------
    corners : (n, 2) array
        Its outline [m].
    label : str
        Text above it.
    filled : bool
        Whether it is filled and hidden below the ground; a ditch or an embankment is drawn as a
        line on the ground.
    old : bool
        Whether it stands already; then it is drawn dashed and in another colour.
    """

    corners: Floats
    label: str = ""
    filled: bool = True
    old: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """Content of an image of a slope, in metres.

    Parameters
    ----------
    ground : (m, 2) array
        Corners of the ground.
    road, zone : (n, 2) array, optional
        Corners of the ground along the road and along the barrier zone.
    sources : sequence of (n, 2) array
        Sources of rock: polygons, or the line of the ground in a band.
    blocks : sequence of (n, 2) array
        Corners of each block.
    barriers : sequence of Outline
        The barriers.
    """

    ground: Floats
    road: Floats | None = None
    zone: Floats | None = None
    sources: Sequence[Floats] = ()
    blocks: Sequence[Floats] = ()
    barriers: Sequence[Outline] = ()


def png(section: Section, title: str = "") -> bytes:
    """Return an image of a section as PNG, with equal axis scales."""
    from matplotlib.figure import Figure

    wide, high = np.ptp(section.ground, axis=0)
    height = min(max(LEAST_IMAGE_HEIGHT, 1.6 + IMAGE_WIDTH * high / wide), GREATEST_IMAGE_HEIGHT)
    figure = Figure(
        (IMAGE_WIDTH, height), dpi=100, layout="constrained"
    )  # not registered with pyplot
    axes = figure.subplots()
    draw(axes, section)
    if title:
        axes.set_title(title, loc="left", fontsize=10, parse_math=False)
    handles, _ = axes.get_legend_handles_labels()
    if handles:
        figure.legend(loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9)
    target = io.BytesIO()
    figure.savefig(target, format="png")
    return target.getvalue()


def draw(axes: Axes, section: Section) -> None:
    """Draw a section into axes."""
    x, y = section.ground.T
    axes.fill_between(x, y, y.min() - 0.05 * np.ptp(y), color=GROUND, linewidth=0)
    for name, line, colour in (
        ("barrier zone", section.zone, ZONE),
        ("road", section.road, ROAD),
    ):
        if line is not None:
            axes.plot(*line.T, color=colour, linewidth=4, label=name)
    for i, corners in enumerate(section.sources):
        label = "rock source" if i == 0 else None
        axes.plot(*corners.T, color="black", linewidth=2.5, label=label)
    for corners in section.blocks:
        axes.fill(*corners.T, facecolor=ROCK, edgecolor=ROCK, linewidth=0.8)
    for barrier in section.barriers:
        colour = OLD if barrier.old else BARRIER
        face = colour if barrier.filled else "white"
        axes.fill(*barrier.corners.T, facecolor=face, edgecolor=colour, linewidth=2.0,
                  linestyle="--" if barrier.old else "-",
                  zorder=0.9 if barrier.filled else 3.0)  # fmt: skip
        if barrier.label:
            axes.annotate(
                barrier.label, (barrier.corners[:, 0].mean(), barrier.corners[:, 1].max()),
                xytext=(0, 10), textcoords="offset points", fontsize=9, color=colour, zorder=4,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1},
            )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return an HTML table; the first cell of each row is its header."""
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = "".join(
        f"<tr><th>{html.escape(name)}</th>"
        + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells)
        + "</tr>"
        for name, *cells in rows
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def image(picture: bytes, words: str) -> str:
    """Return an HTML image that contains a PNG; `words` is its description."""
    data = base64.b64encode(picture).decode("ascii")
    return f'<img src="data:image/png;base64,{data}" alt="{html.escape(words, quote=True)}">'
