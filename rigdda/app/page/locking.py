"""Lock of a document: callbacks that change models of Bokeh run only while it is held.

Bokeh holds the lock of a document during its own callbacks: those of its models, and those that it
runs periodically or at its next tick. Panel runs the watchers of its buttons and of some of its
widgets without the lock, and a change of a model of Bokeh raises an exception there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import panel as pn

AFTER = 50
"""Time after which what takes a while begins [ms]."""

_held: list[Any] = []
"""The documents whose locks the callbacks that are running now hold, the innermost last. All
callbacks run on the thread of the server, one after another."""


def locked(do: Callable[[], object]) -> None:
    """Do something while the lock of the document is held.

    It is done at once if the lock is held already or if there is no server, as in a notebook or a
    test, and otherwise at the next tick of the document.
    """
    document = pn.state.curdoc
    if document is None or document.session_context is None or document in _held:
        do()
    else:
        document.add_next_tick_callback(partial(holding, do))


def soon(do: Callable[[], object]) -> None:
    """Do something that takes a while with the lock held, after the browser has shown the rest.

    Without a server it is done at once.
    """
    document = pn.state.curdoc
    if document is None or document.session_context is None:
        do()
    else:
        document.add_timeout_callback(partial(holding, do), AFTER)


def holding(do: Callable[[], object]) -> None:
    """Do something in a callback of Bokeh, which holds the lock of the document.

    All changes of models are sent at the end, in their order. Otherwise Panel would send its own at
    once or, if the connection is busy, later, and the browser might be told of a change of a model
    before it knows the model.
    """
    document = pn.state.curdoc
    outermost = document is not None and document not in _held
    if outermost:
        document.hold("collect")
    _held.append(document)
    try:
        do()
    finally:
        _held.pop()
        if outermost:
            document.unhold()


def watch(widget: Any, do: Callable[[], object], parameter: str = "value") -> None:
    """Do something with the lock held whenever a parameter of a Panel object changes."""
    widget.param.watch(lambda _: locked(do), parameter)


def on_change(model: Any, name: str, do: Callable[[Any], object]) -> None:
    """Call a function with the new value whenever a property of a Bokeh model changes."""
    model.on_change(name, lambda _, __, new: holding(partial(do, new)))
