"""The server of the page: on this machine only, behind a random token in its address."""

from __future__ import annotations

import asyncio
import secrets
import socket
import webbrowser
from collections.abc import Callable
from typing import Any

import panel as pn
from bokeh.models import CustomJS
from tornado.httputil import HTTPHeaders, HTTPServerRequest
from tornado.web import OutputTransform, StaticFileHandler
from tornado.websocket import WebSocketClosedError

from rigdda import BadInput
from rigdda.app.page import theme
from rigdda.app.page.locking import holding
from rigdda.app.page.page import Page
from rigdda.app.page.state import Project
from rigdda.app.page.workspace import Workspace

HOST = "127.0.0.1"
"""The only address that the server listens at."""

TOKEN = 24
"""Bytes of the token."""

CONNECTION_WAIT = 120_000
"""Time for which a page without a connection is kept [ms]. A busy browser may connect long after it
has got the page, and Bokeh would then make a page whose styles Panel takes from another machine."""

HEADERS = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Content-Security-Policy": (
        "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; "
        "connect-src 'self' ws://127.0.0.1:* ws://localhost:*; frame-ancestors 'none'"
    ),
}
"""Headers of every answer: nothing is loaded from another machine, and no other page may frame
this one. Bokeh compiles its templates at run time and needs 'unsafe-eval'."""


ICON = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 16 16'%3E"
    "%3Cpath d='M0 2L16 16H0z' fill='%236b4226'/%3E%3Ccircle cx='11' cy='5' r='3' "
    "fill='%230b5fa5'/%3E%3C/svg%3E"
)
"""Icon of the page: a block above a slope."""

PATIENT = """
Bokeh.require("core/ui_gestures").UIGestures.press_threshold = 2 ** 31 - 1
"""
"""Script that lets a user hold a handle for as long as they want before they drag it. Bokeh takes a
button that is held still for 0.3 s for a long press, after which nothing can be dragged, and a busy
browser sees every drag like this. No tool of the page uses long presses."""

REFUSED = b"this address is not that of the page\n"
"""Answer to a request that names another host."""


def free_port(port: int | None) -> int:
    """Return a port that nobody listens at, or the port that is asked for.

    Raises
    ------
    BadInput
        If the port is taken.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port or 0))
        except OSError as error:
            hint = f"name a port that is free and allowed ({error.strerror})"
            raise BadInput("--port", port, hint) from None
        return int(probe.getsockname()[1])


def serve(project: Project, port: int | None, browser: bool, say: Callable[[str], None]) -> None:
    """Serve the page of a project until the process is interrupted.

    Parameters
    ----------
    project : Project
        The project.
    port : int, optional
        The port; by default a free one.
    browser : bool
        Whether to open the page in the browser of the system.
    say : callable
        Function that prints a line, which tells the address.

    Raises
    ------
    BadInput
        If the port is taken.
    """
    at, token = free_port(port), secrets.token_urlsafe(TOKEN)
    hosts = [f"{HOST}:{at}", f"localhost:{at}"]
    pn.extension(sizing_mode=None, notifications=False)
    with Workspace(project) as workspace:
        server: Any = pn.serve(
            {"/": lambda: _session(workspace)},
            address=HOST, port=at, prefix=f"/{token}", show=False, start=False, threaded=False,
            websocket_origin=hosts, title="rigdda", verbose=False,
            extra_patterns=[
                ("/report/(.*)", StaticFileHandler, {"path": str(workspace.report_folder)})
            ],
            check_unused_sessions_milliseconds=5000,
            unused_session_lifetime_milliseconds=CONNECTION_WAIT,
            transforms=[type("Guarded", (Guard,), {"hosts": frozenset(hosts)})],
        )  # fmt: skip
        address = f"http://{HOST}:{at}/{token}/"
        say(address)
        if browser:
            webbrowser.open(address)
        server.io_loop.asyncio_loop.set_exception_handler(report)
        server.start()
        try:
            server.io_loop.start()
        except KeyboardInterrupt:
            pass
        finally:
            server.stop()


def report(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report an exception of a task of the server, unless a tab was closed while it was sent to."""
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def _session(workspace: Workspace) -> Any:
    """Return the page of one tab of the browser."""
    colours = theme.DARK if pn.config.theme == "dark" else theme.LIGHT
    pn.config.raw_css = [theme.css(colours)]
    pn.state.curdoc.template_variables["app_favicon"] = ICON
    pn.state.curdoc.js_on_event("document_ready", CustomJS(code=PATIENT))
    made: list[Page] = []
    holding(lambda: made.append(Page(workspace, colours)))
    return made[0].panel


class Guard(OutputTransform):
    """Adds `HEADERS` to each answer, and refuses requests that name another host.

    A page of another site whose name was pointed at this machine sends its own name as the host.
    """

    hosts: frozenset[str] = frozenset()

    def __init__(self, request: HTTPServerRequest):
        self.known = request.host in self.hosts

    def transform_first_chunk(
        self, status_code: int, headers: HTTPHeaders, chunk: bytes, finishing: bool
    ) -> tuple[int, HTTPHeaders, bytes]:
        """Return the status, the headers and the first part of an answer."""
        for name, value in HEADERS.items():
            headers[name] = value
        if self.known:
            return status_code, headers, chunk
        headers["Content-Length"] = str(len(REFUSED))
        return 403, headers, REFUSED

    def transform_chunk(self, chunk: bytes, finishing: bool) -> bytes:
        """Return a later part of an answer."""
        return chunk if self.known else b""
