"""Inputs of the page that are bound to values of a project, with full words and units."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

import panel as pn

from rigdda.app.page.locking import locked

UNITS = {
    "m": "metres", "m2": "square metres", "m3": "cubic metres", "deg": "degrees",
    "kJ": "kilojoules", "J/m": "joules per metre", "years": "years", "-": "",
    "kg/m3": "kilograms per cubic metre", "m/s": "metres per second", "EUR/m": "EUR per metre",
    "EUR/m2": "EUR per square metre", "EUR/m3": "EUR per cubic metre",
    "EUR/day": "EUR per day", "1/year": "per year",
    "1/year per 100 m of slope": "per year on 100 metres of slope",
}  # fmt: skip
"""Units in full words."""


def in_words(name: str, unit: str) -> str:
    """Return the label of a value: its name in words and its unit in full."""
    words = name.replace("_", " ").removesuffix(" deg").removesuffix(" EUR").capitalize()
    unit = UNITS.get(unit, unit)
    return f"{words} [{unit}]" if unit else words


def text(words: str, **style: str) -> pn.pane.HTML:
    """Return a paragraph of plain text; markup in it is shown as it is."""
    return pn.pane.HTML(paragraph(words), sizing_mode="stretch_width", styles=style, margin=(2, 8))


def paragraph(words: str) -> str:
    """Return a text as an HTML paragraph."""
    return f"<p style='margin:2px 0'>{html.escape(words)}</p>"


def heading(words: str) -> pn.pane.HTML:
    """Return a heading of a part of a tab."""
    style = "margin:10px 0 2px;font-size:15px;font-weight:600"
    return pn.pane.HTML(
        f"<h2 style='{style}'>{html.escape(words)}</h2>", sizing_mode="stretch_width", margin=(0, 8)
    )


def table(head: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "") -> str:
    """Return an HTML table of plain texts; columns after the first are aligned to the right."""

    def cell(tag: str, value: str, k: int) -> str:
        side = "left" if k == 0 else "right"
        bold = "600" if tag == "th" else "400"
        style = f"text-align:{side};padding:3px 6px;font-weight:{bold};vertical-align:top"
        scope = " scope='col'" if tag == "th" else ""
        return f"<{tag}{scope} style='{style}'>{html.escape(value)}</{tag}>"

    out = "<table style='border-collapse:collapse;width:100%;font-size:14px'>"
    if caption:
        style = "text-align:left;padding:3px 6px"
        out += f"<caption style='{style}'>{html.escape(caption)}</caption>"
    out += "<tr>" + "".join(cell("th", v, k) for k, v in enumerate(head)) + "</tr>"
    for row in rows:
        line = "border-top:1px solid rgba(128,128,128,.35)"
        out += f"<tr style='{line}'>" + "".join(cell("td", v, k) for k, v in enumerate(row))
        out += "</tr>"
    return out + "</table>"


def legend(items: Iterable[tuple[str, str]]) -> str:
    """Return an HTML line that explains colours, each given with its words."""
    return " ".join(
        f"<span style='white-space:nowrap;margin-right:14px'><span style='display:inline-block;"
        f"width:22px;height:4px;background:{colour};vertical-align:middle'></span> "
        f"{html.escape(words)}</span>"
        for words, colour in items
    )


class Bound:
    """A widget that shows a value of the project and writes what the user enters.

    Parameters
    ----------
    widget : panel widget
        The widget.
    get : callable
        Function that returns the value to show.
    write : callable
        Function of the new value; it shows errors itself.
    parameter : str
        Parameter of the widget that changes when the user has chosen a value.
    """

    def __init__(
        self,
        widget: Any,
        get: Callable[[], Any],
        write: Callable[[Any], None],
        parameter: str = "value",
    ):
        self.widget, self._get, self._write = widget, get, write
        self._showing = False
        self.refresh()
        widget.param.watch(self._changed, parameter)

    def refresh(self) -> None:
        """Show the value of the project."""
        self._showing = True
        try:
            self.widget.value = self._get()
        finally:
            self._showing = False

    def _changed(self, event: Any) -> None:
        if not self._showing and event.new is not None and event.new != self._get():
            locked(partial(self._enter, event.new))

    def _enter(self, value: Any) -> None:
        self._write(value)
        self.refresh()


def number(
    label: str,
    get: Callable[[], float | None],
    write: Callable[[Any], None],
    step: float = 0.5,
    width: int = 150,
    **limits: Any,
) -> Bound:
    """Return an input for a number."""
    widget = pn.widgets.FloatInput(label=label, step=step, width=width, margin=(2, 8), **limits)
    return Bound(widget, get, write)


def choice(
    label: str,
    options: Any,
    get: Callable[[], Any],
    write: Callable[[Any], None],
    width: int = 150,
) -> Bound:
    """Return a choice of one of several options."""
    widget = pn.widgets.Select(label=label, options=options, width=width, margin=(2, 8))
    return Bound(widget, get, write)


def button(label: str, do: Callable[[], object], primary: bool = False, **more: Any) -> Any:
    """Return a button."""
    kind = "primary" if primary else "default"
    found = pn.widgets.Button(label=label, color=kind, **({"margin": (4, 8)} | more))
    found.on_click(lambda _: locked(do))
    return found
