"""Edits of the text of a site file, which keep its comments and its order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.container import OutOfOrderTableProxy
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array, Comment, InlineTable, Item, Null, Table

from rigdda import BadInput
from rigdda.app.value_origins import given

Path = Sequence[str | int]
"""Keys of tables and places in lists that lead to a value, such as ("sources", 0, "band")."""


def dotted(path: Path) -> str:
    """Return a path as messages write it."""
    out = ""
    for key in path:
        out += f"[{key}]" if isinstance(key, int) else f".{key}" if out else key
    return out


def with_value(text: str, path: Path, value: Any) -> str:
    """Return the text of a TOML file with another value at a path.

    A comment that marks the value as a placeholder then says that it is given.

    Parameters
    ----------
    text : str
        Text of the file.
    path : sequence of str and int
        Where the value is. Tables on the way are added if they are missing.
    value : object
        The value, of the types of TOML; None removes the key.

    Raises
    ------
    BadInput
        If the text is not TOML, or the path does not lead to a table or a list in it.
    """
    return with_values(text, {tuple(path): value})


def with_values(text: str, values: Mapping[tuple[str | int, ...], Any]) -> str:
    """Return the text of a TOML file with other values at several paths; see `with_value`."""
    document = _parsed(text)
    for path, value in values.items():
        _set(document, path, value)
    return tomlkit.dumps(document)


def with_table(text: str, name: str, values: Mapping[str, Any]) -> str:
    """Return the text of a TOML file with another table at the end of a list of tables.

    The table is written as the others are: under a header [[...]], or within the brackets of an
    array.

    Raises
    ------
    BadInput
        If the text is not TOML, or the name is not that of a list of tables in it.
    """
    document = _parsed(text)
    tables = document.get(name)
    if tables is None:
        tables = document[name] = tomlkit.aot()
    if not isinstance(tables, list):
        raise BadInput(name, type(tables).__name__, "make it a list of tables, [[...]]")
    if isinstance(tables, Array):
        tables.append(_inline(values))
        return tomlkit.dumps(document)
    table = tomlkit.table()
    table.update(values)
    table.add(tomlkit.nl())
    tables.append(table)
    return tomlkit.dumps(document)


def with_rows(text: str, path: Path, rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the text of a TOML file with another list of tables, one in a line, at a path."""
    found = tomlkit.array()
    for row in rows:
        found.append(_inline(row))
    return with_value(text, path, found.multiline(bool(rows)))


def without(text: str, path: Path) -> str:
    """Return the text of a TOML file without a key, or without an item of a list.

    Raises
    ------
    BadInput
        If the text is not TOML, or there is nothing at the path.
    """
    document = _parsed(text)
    try:
        _remove(document, path)
    except (KeyError, IndexError, TOMLKitError):
        raise BadInput(dotted(path), None, "name something that the file has") from None
    return tomlkit.dumps(document)


def _parsed(text: str) -> Any:
    try:
        return tomlkit.parse(text)
    except TOMLKitError as error:
        raise BadInput("site file", "its text", f"correct its TOML: {error}") from None


def _set(document: Any, path: Path, value: Any) -> None:
    """Set one value in a document, or remove it."""
    for end in range(1, len(path)):
        parent, key = _inner(document, path, path[: end - 1]), path[end - 1]
        if isinstance(path[end], str) and isinstance(key, str) and key not in parent:
            _put(document, path[:end], {})
    parent, key = _inner(document, path, path[:-1]), path[-1]
    if value is not None:
        _put(document, path, value)
        _mark(document, path)
    elif isinstance(key, str) and key in parent:
        _mark(document, path, remove=True)
        _remove(document, path)


def _put(document: Any, path: Path, value: Any) -> None:
    """Put a value at a path; a table among dotted keys is written inline, without a header.

    A header among dotted keys would make those after it part of its table. From a table whose parts
    are apart in the file, an old list is removed first: its replacement would end up in one part
    and discard the others.
    """
    parent, key = _inner(document, path, path[:-1]), path[-1]
    if isinstance(value, Mapping) and _is_dotted(document, path[:-1]):
        value = _inline(value)
    scattered = isinstance(parent, OutOfOrderTableProxy) and isinstance(value, dict | list)
    try:
        if scattered and key in parent:
            del parent[key]
        parent[key] = value
    except (IndexError, KeyError, TypeError, TOMLKitError):
        raise BadInput(dotted(path), value, "name a place that the file has") from None


def _remove(document: Any, path: Path) -> None:
    """Remove a key or an item; a table whose only key it was remains, without keys.

    Raises
    ------
    KeyError, IndexError, TOMLKitError
        If there is nothing at the path.
    """
    parent = _inner(document, path, path[:-1])
    del parent[path[-1]]
    if isinstance(parent, dict) and not parent and _is_dotted(document, path[:-1]):
        _inner(document, path, path[:-2])[path[-2]] = _inline({})


def _inline(values: Mapping[str, Any]) -> InlineTable:
    """Return a table that is written in one line, {...}."""
    table = tomlkit.inline_table()
    table.update(values)
    return table


def _is_dotted(document: Any, path: Path) -> bool:
    """Return whether the table at a path is written by dotted keys, such as road.start = 1.0."""
    found, parts = False, [document]
    for key in path:
        if isinstance(key, int):
            parts, found = [[one for part in parts for one in part][key]], False
            continue
        bodies = [part.value.body if isinstance(part, Item) else part.body for part in parts]
        pairs = [(k, v) for body in bodies for k, v in body if k is not None and k.key == key]
        parts, found = [v for _, v in pairs], any(k.is_dotted() for k, _ in pairs)
    return found


def _mark(document: Any, path: Path, remove: bool = False) -> None:
    """Let the comment in front of a value say that it is given, or remove the comment.

    The comment is that of the innermost key of `path` that is in a line of its own.
    """
    parent, table, name = document, document, path[0]
    for end, key in enumerate(path[1:], start=1):
        parent = parent[path[end - 1]]
        if isinstance(parent, Table):
            table, name = parent, key
    body = (table.value if isinstance(table, Table) else table).body
    places = [k for k, (key, _) in enumerate(body) if key is not None and key.key == name]
    if not places or not places[0] or not isinstance(comment := body[places[0] - 1][1], Comment):
        return
    if remove:
        body[places[0] - 1] = (None, Null())
    else:
        comment.trivia.comment = given(comment.trivia.comment)


def _inner(document: Any, path: Path, part: Path) -> Any:
    """Return the table or list at the beginning `part` of a path."""
    found = document
    for key in part:
        try:
            found = found[key]
        except (KeyError, IndexError, TypeError, TOMLKitError):
            raise BadInput(dotted(path), None, "name a place that the file has") from None
    if not isinstance(found, dict | list):
        raise BadInput(dotted(path), str(found), "name a table or a list")
    return found
