"""A site whose releases cost little: `quick` without its mass."""

from __future__ import annotations

import msgspec

from rigdda import Site

_QUICK = Site.load("quick")

LIGHT = msgspec.structs.replace(_QUICK, events=_QUICK.events[:2], meshes=())
"""`quick` with single blocks and groups only, and without meshes, whose price names events."""
