"""Declarations of file fields: meaning, unit and permitted values, given in one place.

A table of a site, layout or study file is read into a `msgspec.Struct`. Each field is annotated
with `about`::

    height: Annotated[float, about("Height of the crest.", "m", ge=0.001, le=1000.0)] = 1.0

The declarations are used for the validation of files (`read`) and of structs created in Python
(`check`), for docstrings (`documented`), and for the reference and the JSON Schema of files
(`rigdda.sites.document`).
"""

from __future__ import annotations

import difflib
import textwrap
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from itertools import pairwise
from math import inf
from typing import Any, NamedTuple, TypeVar

import msgspec
import numpy as np
from msgspec import inspect as kinds

from rigdda.check import boolean, integer, number
from rigdda.errors import BadInput

Table = TypeVar("Table", bound=msgspec.Struct)
Check = Callable[[str, Any], Any]
"""Function of the name of a field in messages and its value; returns the value, or raises
`BadInput`."""


def about(
    text: str = "",
    unit: str = "",
    *,
    ge: float | None = None,
    gt: float | None = None,
    le: float | None = None,
    least: int | None = None,
    choices: Iterable[str | int] | None = None,
    rising: bool = False,
) -> msgspec.Meta:
    """Return the declaration of a field, for use in its `Annotated` type.

    Parameters
    ----------
    text : str
        Meaning of the field, in complete sentences.
    unit : str
        Its unit, "-" for pure numbers.
    ge, gt, le : float, optional
        Inclusive lower bound, exclusive lower bound and inclusive upper bound of a number. Whole
        numbers are at least 0 by default.
    least : int, optional
        Minimum length of a list or a table.
    choices : iterable, optional
        The permitted values.
    rising : bool
        Whether the numbers of a list must not decrease.
    """
    bounds: dict[str, Any] = {"ge": ge, "gt": gt, "le": le, "min_length": least}
    return msgspec.Meta(
        **bounds,
        description=f"{text} Unit: {unit}." if unit not in ("", "-") else text or None,
        extra_json_schema=None if choices is None else {"enum": list(choices)},
        extra={"text": text, "unit": unit, "rising": rising} if text else None,
    )


def check(record: msgspec.Struct, prefix: str = "") -> None:
    """Check the fields of a struct, and convert each value to its declared type.

    Integers and NumPy scalars given for floats are converted because they would be other types in
    files and for kernels, which would be recompiled. Messages call a field by `prefix` and its
    name.

    Raises
    ------
    BadInput
        If a value is of the wrong type or outside its range.
    """
    for name, (sound, default) in _checks(type(record)).items():
        value = getattr(record, name)
        if value is not default:
            msgspec.structs.force_setattr(record, name, sound(prefix + name, value))


def parse(what: str, name: str, text: str, form: str = "TOML") -> dict[str, Any]:
    """Return the content of a TOML or JSON text, called `what` = `name` in error messages.

    Raises
    ------
    BadInput
        If the text is not valid, or its top level is not a table.
    """
    try:
        found = (msgspec.json if form == "JSON" else msgspec.toml).decode(text)
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadInput(what, name, f"correct its {form}: {error}") from None
    if not isinstance(found, dict):
        raise BadInput(what, name, "give a table, {...}, at the top level")
    return found


def read(table: type[Table], value: Any, where: str = "") -> Table:
    """Return the struct of a table of a file; `where` is the path of the table in the file.

    A struct calls itself by `array`, the array of tables in which it occurs, and its name. Several
    tables may have the same name by default, so that `where` replaces this path in messages.

    Raises
    ------
    BadInput
        As `checked` does, and if fields are inconsistent.
    """
    values = checked(table, value, where)
    try:
        return table(**values)
    except BadInput as bad:
        path = _own_path(table, values)
        if not (where and path and bad.field.startswith(path)):
            raise
        raise BadInput(where + bad.field.removeprefix(path), bad.value, bad.hint) from None


def _own_path(table: type[msgspec.Struct], values: Mapping[str, Any]) -> str:
    """Return how a struct of an array of tables calls itself in messages; empty for others."""
    array = getattr(table, "array", "")
    return f"{array}.{values.get('name', _checks(table)['name'][1])}" if array else ""


def checked(table: type[msgspec.Struct], value: Any, where: str = "") -> dict[str, Any]:
    """Return the validated fields of a table of a file; errors name the path in the file.

    Raises
    ------
    BadInput
        If it is not a table, a key is missing, unknown or a former one (`retired` of the table, a
        dict from key to advice), or a value is of the wrong type or outside its range.
    """
    if not isinstance(value, Mapping):
        raise BadInput(where, value, "give a table")
    prefix, checks = f"{where}." if where else "", _checks(table)
    for key in value:
        if key not in checks:
            if key in getattr(table, "retired", {}):
                raise BadInput(f"{prefix}{key}", value[key], table.retired[key])  # type: ignore[attr-defined]
            near = difflib.get_close_matches(str(key), checks, 1)
            hint = f"did you mean {near[0]}?" if near else f"use one of {', '.join(checks)}"
            raise BadInput(f"{prefix}{key}", value[key], f"there is no such key: {hint}")
    for field in described(table):
        if field.needed and field.name not in value:
            hint = f"add this key, which has no default: {field.text}"
            raise BadInput(prefix + field.name, None, hint)
    return {key: checks[key][0](prefix + key, item) for key, item in value.items()}


@cache
def _checks(table: type[msgspec.Struct]) -> dict[str, tuple[Check, Any]]:
    """Return the check and the default of each field."""
    defaults = {field.name: field.default for field in msgspec.structs.fields(table)}
    fields = kinds.type_info(table).fields  # type: ignore[attr-defined]
    return {field.name: (_check(field.type), defaults[field.name]) for field in fields}


def _check(kind: kinds.Type, unit: str = "") -> Check:
    """Return the validator of a type; `unit` is that of its numbers."""
    bare = _bare(kind)
    if bare != kind:
        sound = _check(bare, unit)
        return lambda field, value: None if value is None else sound(field, value)
    match kind:
        case kinds.Metadata(type=inner):
            extra = kind.extra or {}
            unit = extra.get("unit", unit)
            choices = (kind.extra_json_schema or {}).get("enum")
            sound = _choice(choices, unit) if choices else _check(inner, unit)
            return _rising(sound) if extra.get("rising") else sound
        case kinds.FloatType() | kinds.IntType():
            return _number(kind, unit)
        case kinds.LiteralType(values=values):
            return _choice(values)
        case kinds.StrType():
            return _text
        case kinds.BoolType():
            return boolean
        case kinds.TupleType(item_types=items):
            return _list(_check(items[0], unit), len(items), len(items))
        case kinds.VarTupleType(item_type=item):
            return _list(_check(item, unit), kind.min_length or 0)
        case kinds.DictType():
            return _dict(_check(kind.key_type), _check(kind.value_type, unit), kind.min_length or 0)
        case kinds.StructType(cls=table):
            return lambda field, value: (
                value if isinstance(value, table) else read(table, value, field)
            )
        case _:
            return lambda field, value: value


def _number(kind: Any, unit: str) -> Check:
    """Return the validator of a number with bounds; `unit` is used in its message."""
    if isinstance(kind, kinds.IntType):
        return lambda field, value: integer(field, value, kind.ge or 0, kind.le or inf)
    is_open = kind.gt is not None
    low = kind.gt if is_open else -inf if kind.ge is None else kind.ge
    high, unit = inf if kind.le is None else kind.le, "" if unit == "-" else unit
    return lambda field, value: number(field, value, low, high, open_low=is_open, unit=unit)


def _text(field: str, value: Any) -> str:
    if not isinstance(value, str):
        raise BadInput(field, value, "give a text")
    return str(value)


def _choice(choices: Iterable[Any], unit: str = "") -> Check:
    def sound(field: str, value: Any) -> Any:
        plain = isinstance(value, str | int | float | np.number) and not isinstance(value, bool)
        for choice in choices if plain else ():
            if value == choice:
                return choice
        known = ", ".join(str(choice) for choice in choices if choice != "")
        raise BadInput(field, value, f"give one of {known} {unit}".rstrip())

    return sound


def _rising(sound: Check) -> Check:
    def in_order(field: str, value: Any) -> Any:
        found = sound(field, value)
        if any(second < first for first, second in pairwise(found)):
            raise BadInput(field, value, "give the smaller number first, then the larger")
        return found

    return in_order


def _list(sound: Check, least: int, most: float = inf) -> Check:
    def members(field: str, value: Any) -> tuple[Any, ...]:
        given = value.tolist() if isinstance(value, np.ndarray) else value
        if not isinstance(given, list | tuple) or not least <= len(given) <= most:
            size = f" of {'' if least == most else 'at least '}{least} values" if least else ""
            raise BadInput(field, value, f"give a list{size}")
        names = [item.get("name") if isinstance(item, Mapping) else None for item in given]
        return tuple(
            sound(
                f"{field}.{name}"
                if name and isinstance(name, str) and names.count(name) == 1
                else f"{field}[{i}]",
                item,
            )
            for i, (name, item) in enumerate(zip(names, given, strict=True))
        )

    return members


def _dict(key: Check, sound: Check, least: int) -> Check:
    def table(field: str, value: Any) -> dict[str, Any]:
        if not isinstance(value, Mapping):
            raise BadInput(field, value, "give a table")
        if len(value) < least:
            hint = f"give at least {least} of its keys, or leave the table out to have its default"
            raise BadInput(field, dict(value), hint)
        return {key(field, name): sound(f"{field}.{name}", item) for name, item in value.items()}

    return table


class Described(NamedTuple):
    """Description of a field in words."""

    name: str
    kind: str
    """Type as in Python and TOML."""
    unit: str
    range: str
    """Permitted values; empty if all are."""
    text: str
    """Meaning of the field."""
    needed: bool
    default: Any
    """Default; without meaning if the field is needed."""


@cache
def described(table: type[msgspec.Struct]) -> tuple[Described, ...]:
    """Return the descriptions of the fields of a table, in order."""
    found = []
    types = kinds.type_info(table).fields  # type: ignore[attr-defined]
    for field, one in zip(msgspec.structs.fields(table), types, strict=True):
        kind = _bare(one.type)
        extra = (kind.extra if isinstance(kind, kinds.Metadata) else None) or {}
        made = field.default_factory is not msgspec.NODEFAULT
        default = field.default_factory() if made else field.default
        unit, text = extra.get("unit", ""), extra.get("text", "")
        words = _words(kind), unit, _range(kind), text, field.required, default
        found.append(Described(field.name, *words))
    return tuple(found)


def documented(table: type[Table]) -> type[Table]:
    """Add the fields of a struct to its docstring as parameters (a class decorator)."""
    table.__doc__ = _Docstring(table.__doc__ or "")  # type: ignore[assignment]
    return table


class _Docstring:
    """A docstring with the fields of a struct, created on first access to keep imports fast."""

    def __init__(self, text: str):
        self.before, *self.after = text.partition("    Raises\n")

    def __get__(self, _: object, table: type[msgspec.Struct]) -> str:
        lines = ["    Parameters", "    ----------"]
        for field in described(table):
            limits = f", {field.range} {field.unit}".rstrip(" -") if field.range else ""
            unit = f", in {field.unit}" if field.unit not in ("", "-") and not limits else ""
            lines.append(f"    {field.name} : {field.kind}{limits or unit}")
            lines += textwrap.wrap(
                field.text, 92, initial_indent=" " * 8, subsequent_indent=" " * 8
            )
        return "\n".join([self.before.rstrip(), "", *lines, "", "".join(self.after)])


def _bare(kind: kinds.Type) -> kinds.Type:
    """Return a type without the alternative None."""
    match kind:
        case kinds.Metadata(type=inner):
            return msgspec.structs.replace(kind, type=_bare(inner))
        case kinds.UnionType(types=types):
            (inner,) = (one for one in types if not isinstance(one, kinds.NoneType))
            return inner
        case _:
            return kind


TYPE_WORDS = {kinds.FloatType: "float", kinds.IntType: "int", kinds.StrType: "str"}


def _words(kind: kinds.Type) -> str:
    """Return the type of a field in words."""
    match kind:
        case kinds.Metadata(type=inner):
            return _words(inner)
        case kinds.BoolType():
            return "bool"
        case kinds.TupleType(item_types=items):
            return f"[{', '.join(map(_words, items))}]"
        case kinds.VarTupleType(item_type=item):
            return f"list of {_plural(_words(item))}"
        case kinds.DictType(value_type=value):
            return f"table of {_plural(_words(value))}"
        case kinds.StructType():
            return "table"
        case _:
            return TYPE_WORDS.get(type(kind), "str")


def _plural(words: str) -> str:
    """Return the plural of a type: floats, tables, lists of floats, [float, float]."""
    first, of, rest = words.partition(" ")
    return words if words.startswith("[") else f"{first}s{of}{rest}"


def _range(kind: kinds.Type) -> str:
    """Return the permitted values of a type in words."""
    match kind:
        case kinds.Metadata(type=inner):
            choices = (kind.extra_json_schema or {}).get("enum")
            return ", ".join(str(one) for one in choices if one != "") if choices else _range(inner)
        case kinds.LiteralType(values=values):
            return ", ".join(map(str, values))
        case kinds.TupleType(item_types=(item, *_)) | kinds.VarTupleType(item_type=item):
            return _range(item)
        case kinds.DictType(value_type=value):
            return _range(value)
        case kinds.FloatType() | kinds.IntType():
            low = kind.ge if kind.gt is None else kind.gt
            if kind.le is not None:
                between = " to " if kind.gt is None else ", at most "
                return f"{'' if kind.gt is None else 'above '}{low:g}{between}{kind.le:g}"
            return "" if low is None else f"{'at least' if kind.gt is None else 'above'} {low:g}"
        case _:
            return ""
