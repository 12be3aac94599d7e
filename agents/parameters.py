"""Numbers of a site file that are fitted, and a site with other values of them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import msgspec

from rigdda import BadInput, Site
from rigdda.model.place import Rebound

RANGES = {
    "scatter.friction_deg": (0.0, 10.0),
    "friction_deg": (15.0, 65.0),
    "restitution": (0.0, 0.8),
    "damping": (0.0, 3.0),
    "friction_sd_deg": (0.0, 10.0),
    "restitution_sd": (0.0, 0.2),
    "damping_sd": (0.0, 1.0),
    "roughness": (0.0, 0.2),
    "normal": (0.0, 0.8),
    "tangential": (0.4, 1.0),
}
"""Limits of a parameter that comes without, by its path or by the last name of that."""


class Parameter(NamedTuple):
    """A number of a site file that is fitted, such as `surfaces.soil.restitution`."""

    path: str
    low: float
    high: float


def parse(text: str) -> Parameter:
    """Return a parameter written as PATH or PATH=LOW:HIGH.

    Raises
    ------
    BadInput
        If it is written otherwise, or has no limits and no usual ones.
    """
    path, given, limits = text.partition("=")
    if not given:
        usual = RANGES.get(path, RANGES.get(path.rpartition(".")[2]))
        if usual is None:
            raise BadInput("--parameters", text, f"give limits: {path}=LOW:HIGH")
        return Parameter(path, *usual)
    found = re.fullmatch(r"([^:]+):([^:]+)", limits)
    try:
        low, high = map(float, found.groups() if found else ())
    except ValueError:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH") from None
    if not -math.inf < low < high < math.inf:
        raise BadInput("--parameters", text, f"write {path}=LOW:HIGH, LOW below HIGH")
    return Parameter(path, low, high)


TELLING = {"blocks": ("surfaces", "motion", "scatter"), "lumped": ("lumped", "scatter")}
"""Tables of a site file whose numbers the run-outs of a model depend on."""


def check_parameters(parameters: Sequence[Parameter], model: str) -> None:
    """Check that the run-outs of a model can tell parameters, each named once.

    Raises
    ------
    BadInput
        If not.
    """
    for i, parameter in enumerate(parameters):
        if parameter.path in (other.path for other in parameters[:i]):
            raise BadInput("--parameters", parameter.path, "name each number once")
        if parameter.path.partition(".")[0] not in TELLING[model]:
            known = ", ".join(f"{name}.*" for name in TELLING[model])
            mend = f"run-outs of the model {model} tell nothing of it: choose from {known}"
            raise BadInput("--parameters", parameter.path, mend)


def with_values(site: Site, parameters: Sequence[Parameter], values: Sequence[float]) -> Site:
    """Return a site with other values of some numbers.

    Raises
    ------
    BadInput
        If there is no such number, or the site is not sound with the value.
    """
    tables = msgspec.to_builtins(site)
    for parameter, value in zip(parameters, values, strict=True):
        *tops, last = parameter.path.split(".")
        table: Any = tables
        for top in tops:
            if top in site.surfaces and table is tables.get("lumped"):
                table.setdefault(top, {})
            table = table.get(top) if isinstance(table, dict) else None
        own = Rebound.__struct_fields__ if tops[:1] == ["lumped"] else ()
        known = isinstance(table, dict) and (last in table or last in own)
        if not known or isinstance(table.get(last, 0.0), str | dict | list | tuple | bool):
            mend = "name a number of the site file, such as surfaces.soil.restitution"
            raise BadInput("--parameters", parameter.path, mend)
        table[last] = float(value)
    try:
        return msgspec.convert(tables, Site)
    except msgspec.ValidationError as error:
        bad = error.__cause__
        if not isinstance(bad, BadInput):
            raise BadInput("--parameters", parameters[0].path, str(error)) from None
        given = [p.path for p, value in zip(parameters, values, strict=True) if value == bad.value]
        where = next((name for name in given if name.endswith(f".{bad.field}")), bad.field)
        raise BadInput(where, bad.value, bad.mend) from None
