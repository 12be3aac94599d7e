"""Colours and sizes of the page, in light and dark."""

from __future__ import annotations

from typing import NamedTuple


class Theme(NamedTuple):
    """Colours of the page and its pictures; they can be told apart by the colour-blind."""

    name: str
    text: str
    quiet: str
    """Less important text and axes."""
    paper: str
    grid: str
    accent: str
    bad: str
    """What breaks a rule or a check."""
    good: str
    rock: str
    road: str
    grounds: tuple[str, ...]
    """Fills of the ground, in the order in which grounds come down the slope."""


LIGHT = Theme(
    "light", "#1b1f24", "#57606a", "#ffffff", "#e4e7eb", "#0b5fa5", "#b3261e", "#00694e",
    "#6b4226", "#3d434b",
    ("#cfc8bd", "#e4d5a8", "#c5d6b5", "#dcb994", "#c9d3e0", "#d9c7d9", "#b9c0b8", "#e6e0d6"),
)  # fmt: skip

DARK = Theme(
    "dark", "#e8eaed", "#a4acb5", "#16191d", "#2c3238", "#6cb4ee", "#ff8a80", "#4fc3a1",
    "#c99a6b", "#aab2bb",
    ("#5b564e", "#6f6440", "#4c5d3f", "#6e5236", "#4a5566", "#5f4d5f", "#434a43", "#55524c"),
)  # fmt: skip

SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9", "#7b4fb0", "#8a8a8a")
"""Colours of events and classes after Okabe and Ito, which the colour-blind can tell apart."""

SCALE = ("#443983", "#31688e", "#21918c", "#35b779", "#90d743", "#fde725")
"""Colours of growing values (viridis)."""

CSS = """
:root { --accent: ACCENT; color-scheme: SCHEME; }
html, body { background: PAPER; color: TEXT; margin: 0; }
body { font: 15px/1.45 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
"""


def css(theme: Theme) -> str:
    """Return the style of the page."""
    out = CSS.replace("ACCENT", theme.accent).replace("PAPER", theme.paper)
    return out.replace("TEXT", theme.text).replace("SCHEME", theme.name)


def tab_css(theme: Theme) -> str:
    """Return the style of the titles of the tabs."""
    return f".bk-tab, .bk-tab.bk-active {{ color: {theme.text}; }}"


TALL = {"height": "max(610px, calc(100vh - 100px))"}
"""Style of a column as high as the window below the titles of the tabs."""

WRAPPED = ".bk-input-group { display: flex; flex-wrap: wrap; }"
"""Style of options in a row that continue in the next line."""
