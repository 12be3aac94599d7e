"""Polylines of DXF drawings, read by ezdxf, which is the extra `dxf`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigdda.errors import BadInput
from rigdda.files import is_file

Floats = NDArray[np.float64]

LINES = "LWPOLYLINE POLYLINE SPLINE"
"""Kinds of entity that can be a profile."""

SAGITTA = 0.005
"""Greatest distance of a chord from an arc or spline that it stands for [m]."""

LEVEL = 1e-6
"""Range of a coordinate below which it counts as constant [m]."""


UNITS = {
    1: "inches", 2: "feet", 3: "miles", 4: "millimetres", 5: "centimetres", 7: "kilometres",
    8: "microinches", 9: "mils", 10: "yards", 14: "decimetres", 15: "decametres", 16: "hectometres",
    21: "US survey feet", 22: "US survey inches", 23: "US survey yards", 24: "US survey miles",
}  # fmt: skip
"""Names of $INSUNITS other than none, 0, and metres, 6."""


def polyline(path: Path, layer: str | None = None) -> tuple[Floats, tuple[str, ...]]:
    """Return the vertices of the polyline of a drawing, and notes on how it was read.

    The vertices are (n, 2), or (n, 3) in space [m].

    Arcs and splines are replaced by chords. For a line in the plane x, z, its x and z are returned.

    Raises
    ------
    BadInput
        If ezdxf is not installed, the file is not a DXF drawing or is not in metres, or the drawing
        has no polyline, or has several and `layer` does not name the layer of one.
    """
    unit, lines = _polylines(path)
    if not lines:
        hint = "draw the profile as one polyline in model space, and join lines into a polyline"
        raise BadInput("--profile", str(path), hint)
    layers = [line.dxf.layer for line in lines]
    if layer is not None:
        lines = [line for line in lines if line.dxf.layer == layer]
        if len(lines) != 1:
            names = ", ".join(sorted(set(layers)))
            hint = f"name a layer with one polyline; the drawing has polylines on {names}"
            raise BadInput("--layer", layer, hint)
    if len(lines) > 1:
        names = ", ".join(sorted(set(layers)))
        hint = f"name the layer of the profile with --layer; there are polylines on {names}"
        raise BadInput("--profile", f"{len(lines)} polylines", hint)
    if unit not in (0, 6):
        name = UNITS.get(unit, f"unit {unit}")
        hint = "scale it to metres, or set its unit to metres if it is drawn in metres"
        raise BadInput("--profile", f"a drawing in {name} ($INSUNITS = {unit})", hint)
    notes = () if unit else ("the drawing names no unit ($INSUNITS): metres are assumed",)
    return _vertices(path, lines[0]), notes


def _polylines(path: Path) -> tuple[int, list[Any]]:
    """Return $INSUNITS and the polylines and splines in the model space of a drawing."""
    try:
        import ezdxf
    except ImportError:
        hint = 'install ezdxf, pip install "rigdda[dxf]", or save the profile as CSV'
        raise BadInput("--profile", str(path), hint) from None
    if not is_file(path):
        raise BadInput("--profile", str(path), "name a file to read (no such file)")
    try:
        document = ezdxf.readfile(path)
        lines = [
            line
            for line in document.modelspace().query(LINES)
            if line.dxftype() != "POLYLINE" or line.is_2d_polyline or line.is_3d_polyline
        ]
        return int(document.header.get("$INSUNITS", 0)), lines
    except Exception as error:  # a damaged file causes any: StopIteration if it is cut off
        words = " ".join(str(error).split())[:80] or type(error).__name__
        raise BadInput("--profile", str(path), f"save it as DXF again ({words})") from None


def _vertices(path: Path, line: Any) -> Floats:
    """Return the vertices of a polyline or spline."""
    corners = np.array(_corners(line), dtype=np.float64).reshape(-1, 3)
    if len(corners) < 2 or not np.isfinite(corners).all():
        hint = "draw the profile as a polyline of at least two points with finite coordinates"
        raise BadInput("--profile", str(path), hint)
    x_range, y_range, z_range = np.ptp(corners, axis=0)
    if z_range < LEVEL:
        if abs(corners[0, 2]) > LEVEL:
            hint = (
                "draw the profile with x as chainage and y as elevation, or with the elevation of "
                "each vertex: this line is level, as one in plan"
            )
            raise BadInput("--profile", f"a line at elevation {corners[0, 2]:g}", hint)
        return corners[:, :2]
    if y_range < LEVEL and x_range >= LEVEL:
        return corners[:, [0, 2]]
    return corners


def _corners(line: Any) -> list[tuple[float, ...]]:
    """Return the corners of a polyline, with chords in place of arcs and splines.

    A polyline of release 12 that was fitted by a spline holds the points of the curve beside those
    of the frame that controls it.
    """
    from ezdxf.path import make_path

    if line.dxftype() == "POLYLINE" and line.dxf.flags & line.SPLINE_FIT_VERTICES_ADDED:
        vertices = [v for v in line.vertices if not v.dxf.flags & v.SPLINE_FRAME_CONTROL_POINT]
        return [tuple(v.dxf.location) for v in vertices]
    return [tuple(v) for v in make_path(line).flattening(SAGITTA)]
