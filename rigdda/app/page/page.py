"""The page of one tab of the browser: its head, its tabs, and what all of them share."""

from __future__ import annotations

import html
import importlib
import threading
from collections.abc import Callable
from functools import partial

import panel as pn
from bokeh.models import Tooltip

from rigdda import BadInput, Error
from rigdda.app.page.forms import button, text
from rigdda.app.page.loading import IMPORTING
from rigdda.app.page.locking import holding, locked, watch
from rigdda.app.page.state import Conflict
from rigdda.app.page.theme import Theme, tab_css
from rigdda.app.page.workspace import Tab, Workspace

TICK = 50
"""Milliseconds between two looks at what has changed."""

RARELY = 20
"""Number of such looks between two looks at the files on disk."""

TABS = ("Slope", "Falls", "Ground", "Barriers", "Decide", "Report")
"""Titles of the tabs in the order of use. The tab Slope is `slope_tab.SlopeTab`, and so on."""


def tab_class(title: str) -> type[Tab]:
    """Return the class of a tab; its module is imported when it is first needed."""
    with IMPORTING:
        module = importlib.import_module(f"rigdda.app.page.{title.lower()}_tab")
    found: type[Tab] = getattr(module, f"{title}Tab")
    return found


def _import_tabs() -> None:
    """Import the modules of all tabs, and what makes a site of a survey."""
    with IMPORTING:
        importlib.import_module("rigdda.app.new_site")
    for title in TABS:
        tab_class(title)


class Page:
    """The page of one tab of the browser.

    Parameters
    ----------
    workspace : Workspace
        What all tabs share.
    theme : Theme
        The colours.
    """

    def __init__(self, workspace: Workspace, theme: Theme):
        self.workspace, self.project, self.theme = workspace, workspace.project, theme
        self._seen = -1
        self._count = 0
        self._loaded = False
        self._message = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 8))
        self._title = pn.pane.HTML("", margin=(6, 8), sizing_mode="stretch_width")
        # their texts change with each edit; a new model would make Bokeh look at all others again
        self._undo_words, self._redo_words = (Tooltip(position="bottom") for _ in range(2))
        self._undo = button(
            "Undo", lambda: self.act(self.project.undo), width=90, description=self._undo_words
        )
        self._redo = button(
            "Redo", lambda: self.act(self.project.redo), width=90, description=self._redo_words
        )
        self._reread = button("Read the file again", self._read_again, visible=False)
        self._keep = button("Keep what the page shows", self._keep_mine, visible=False)
        self._built: dict[str, Tab] = {}
        self._tabs = pn.Tabs(
            *(
                (title, pn.Column(text("One moment."), sizing_mode="stretch_width"))
                for title in TABS
            ),
            sizing_mode="stretch_width",
            stylesheets=[tab_css(theme)],
        )
        watch(self._tabs, self._turn, "active")
        other = "light" if theme.name == "dark" else "dark"
        link = pn.pane.HTML(
            f"<a href='?theme={other}' style='color:{theme.accent}'>{other} colours</a>",
            margin=(10, 12), width=100,
        )  # fmt: skip
        self.panel = pn.Column(
            pn.Row(self._title, self._undo, self._redo, link, sizing_mode="stretch_width"),
            pn.Row(self._message, self._reread, self._keep, sizing_mode="stretch_width"),
            self._tabs,
            sizing_mode="stretch_width",
        )
        self._refresh()
        document = pn.state.curdoc
        if document is None:  # in a notebook
            pn.state.add_periodic_callback(self._tick, TICK)
        else:  # Bokeh locks the document while its own callbacks run
            document.add_periodic_callback(partial(holding, self._tick), TICK)
        pn.state.onload(self._load)

    @property
    def active(self) -> Tab:
        """The tab that is shown; it is built when it is first shown."""
        title = TABS[self._tabs.active]
        if title not in self._built:
            self._built[title] = tab_class(title)(self)
        return self._built[title]

    def act(self, do: Callable[[], object]) -> bool:
        """Do something to the project, show its error if there is one, and what has changed.

        Returns
        -------
        bool
            Whether it was done.
        """
        try:
            do()
        except Conflict as error:
            self._say(str(error), bad=True)
            self._reread.visible = self._keep.visible = True
            return False
        except (Error, OSError) as error:
            self._say(_words(error), bad=True)
            self._later()
            return False
        self._say("")
        self._later()
        return True

    def say(self, words: str) -> None:
        """Show a message in the head of the page."""
        self._say(words)

    def _say(self, words: str, bad: bool = False) -> None:
        role = "alert" if bad else "status"
        colour = self.theme.bad if bad else self.theme.text
        self._message.object = (
            f"<div role='{role}' style='color:{colour}'>{html.escape(words)}</div>" if words else ""
        )

    def _read_again(self) -> None:
        self._reread.visible = self._keep.visible = False
        self.act(self.project.refresh)

    def _keep_mine(self) -> None:
        self._reread.visible = self._keep.visible = False
        self.act(self.project.keep_mine)

    def _later(self) -> None:
        """Show the project as it is as soon as the lock of the document is held."""
        self._seen = -1
        locked(self._refresh)

    def _load(self) -> None:
        """Begin with work in threads, which would delay the page before the browser shows it."""
        self._loaded = True
        threading.Thread(target=_import_tabs, name="tabs", daemon=True).start()

    def _turn(self) -> None:
        """Show the tab that was opened, without the message about what was done in another."""
        if not self._keep.visible:
            self._say("")
        self._refresh()

    def _tick(self) -> None:
        if not self._loaded:
            return
        self._count += 1
        if self._count % RARELY == 0 and not self._keep.visible:
            try:
                if self.project.refresh():
                    self._say("another program has changed a file; it was read again")
            except BadInput as bad:
                self._say(f"another program has changed a file: {bad}", bad=True)
                self._reread.visible = self._keep.visible = True
        if self._seen != self.project.revision:
            self._refresh()
        if self.project.has_site and not self.workspace.draws:
            others = tuple(self.project.alternatives.values())
            self.workspace.live.ask(self.project.site, self.project.layout, others)
        self.workspace.write_study()
        self.active.tick()

    def _refresh(self) -> None:
        """Show the project as it is in the head and in the tab that is open."""
        project = self.project
        self._seen = project.revision
        name = project.site.name if project.has_site else "no site yet"
        where = str(project.where.site)
        quiet = f"color:{self.theme.quiet};font-size:13px"
        self._title.object = (
            f"<h1 style='font-size:19px;margin:0;display:inline'>{html.escape(name)}</h1> "
            f"<span style='{quiet}'>{html.escape(where)}</span>"
        )
        self._undo.disabled, self._redo.disabled = not project.undoes, not project.redoes
        self._undo_words.content = f"Undo: {project.undoes or 'nothing'}"
        self._redo_words.content = f"Redo: {project.redoes or 'nothing'}"
        tab = self.active
        tab.show()
        place = self._tabs[self._tabs.active]
        if place[0] is not tab.panel:  # drawn with its data
            place[:] = [tab.panel]


def _words(error: Exception) -> str:
    """Return an error as a sentence; a value that is missing is not mentioned."""
    if isinstance(error, BadInput) and error.value is None:
        return f"{error.field}: {error.hint}"
    return str(error)
