"""How a replay looks: its camera, layers and colours."""

from __future__ import annotations

Colour = tuple[int, int, int]

CAMERA = 1000.0
"""Distance of the camera [m]: one pixel is one metre, and a layer shifts a point by 1e-5."""
LAYER = {"terrain": 0.0, "barriers": 0.02, "road": 0.04, "blocks": 0.06}
LABEL = 0.05
"""Height of a label above the top of its barrier, as a share of the view; every third is as
high."""
DOT = -3.0
"""Radius of the dot of a label: negative numbers are points of the screen."""
EDGE = 0.01
"""z of a layer, and of an outline above its fill [m]."""

SKY: Colour = (233, 240, 246)
GROUND: Colour = (201, 188, 165)
BARRIER: Colour = (28, 90, 160)
BROKEN: Colour = (176, 182, 188)
FAILED: Colour = (214, 40, 70)
ROAD: Colour = (232, 93, 4)
ROCK: tuple[Colour, ...] = ((104, 88, 74), (128, 108, 90), (88, 80, 76), (146, 122, 98))
INK: Colour = (40, 34, 30)
