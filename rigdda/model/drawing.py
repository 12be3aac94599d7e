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


def polyline(path: Path, layer: str | None = None) -> Floats:
    """Return the vertices of the polyline of a drawing: (n, 2), or (n, 3) in space [m].

    Arcs and splines are replaced by chords. A line in the plane x, z has its x and z returned.

    Raises
    ------
    BadInput
        If ezdxf is not installed, the file is no DXF drawing, or the drawing has no polyline, or
        has several and `layer` does not name the layer of one.
    """
    found = _polylines(path)
    if not found:
        mend = "draw the profile as one polyline in model space, and join lines into a polyline"
        raise BadInput("--profile", str(path), mend)
    layers = [line.dxf.layer for line in found]
    if layer is not None:
        found = [line for line in found if line.dxf.layer == layer]
        if len(found) != 1:
            names = ", ".join(sorted(set(layers)))
            mend = f"name a layer with one polyline; the drawing has polylines on {names}"
            raise BadInput("--layer", layer, mend)
    if len(found) > 1:
        names = ", ".join(sorted(set(layers)))
        mend = f"name the layer of the profile by --layer; there are polylines on {names}"
        raise BadInput("--profile", f"{len(found)} polylines", mend)
    return _vertices(path, found[0])


def _polylines(path: Path) -> list[Any]:
    """Return the polylines and splines in the model space of a drawing."""
    try:
        import ezdxf
    except ImportError:
        mend = 'install ezdxf, pip install "rigdda[dxf]", or save the profile as CSV'
        raise BadInput("--profile", str(path), mend) from None
    if not is_file(path):
        raise BadInput("--profile", str(path), "name a file to read (no such file)")
    try:
        space = ezdxf.readfile(path).modelspace()
        return [
            line
            for line in space.query(LINES)
            if line.dxftype() != "POLYLINE" or line.is_2d_polyline or line.is_3d_polyline
        ]
    except (OSError, ValueError, LookupError, ezdxf.DXFError) as error:
        words = " ".join(str(error).split())[:80] or type(error).__name__
        raise BadInput("--profile", str(path), f"save it as DXF again ({words})") from None


def _vertices(path: Path, line: Any) -> Floats:
    """Return the vertices of a polyline or spline."""
    from ezdxf.path import make_path

    corners = np.array([tuple(v) for v in make_path(line).flattening(SAGITTA)], dtype=np.float64)
    if len(corners) < 2 or not np.isfinite(corners).all():
        mend = "draw the profile as a polyline of at least two points with finite coordinates"
        raise BadInput("--profile", str(path), mend)
    x_range, y_range, z_range = np.ptp(corners, axis=0)
    if z_range < LEVEL:
        return corners[:, :2]
    if y_range < LEVEL and x_range >= LEVEL:
        return corners[:, [0, 2]]
    return corners
