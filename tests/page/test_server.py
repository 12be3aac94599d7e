"""Who may see the page: the token, the host and the origin; no Panel in other commands."""

import asyncio
import http.client
import subprocess
import sys
import types
from urllib.parse import urlsplit

import pytest
from click.testing import CliRunner
from tornado.websocket import WebSocketClosedError

from rigdda import BadInput, sites
from rigdda.app.commands import open as command
from rigdda.app.page.server import HEADERS, REFUSED, free_port, report


def _get(address: str, path: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
    to = urlsplit(address)
    connection = http.client.HTTPConnection(to.hostname, to.port, timeout=60)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


async def _upgraded(address: str, path: str, origin: str) -> int:
    """Return the status of the answer to the beginning of a websocket."""
    to = urlsplit(address)
    reader, writer = await asyncio.open_connection(to.hostname, to.port)
    lines = [
        f"GET {path} HTTP/1.1", f"Host: {to.netloc}", f"Origin: {origin}", "Upgrade: websocket",
        "Connection: Upgrade", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol: bokeh, x",
    ]  # fmt: skip
    writer.write(("\r\n".join(lines) + "\r\n\r\n").encode())
    await writer.drain()
    status = await reader.readline()
    writer.close()
    await writer.wait_closed()
    return int(status.split()[1])


def test_only_the_token_the_host_and_the_origin_open_the_page(serve, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    server = serve(folder)
    at, token = server.address, urlsplit(server.address).path
    assert at.startswith("http://127.0.0.1:")
    assert len(token) > 30
    status, headers, _ = _get(at, token)
    assert status == 200
    assert HEADERS.items() <= headers.items()
    for path in ("/", "/guess/", "/ws", "/guess/ws", "/static/js/bokeh.min.js", "/report/x"):
        assert _get(at, path)[0] == 404
    assert _get(at, f"{token}report/../../site.toml")[0] in (403, 404)
    assert _get(at, token, Host="evil.example")[::2] == (403, REFUSED)
    own = f"http://{urlsplit(at).netloc}"
    for path, origin, known in (
        (f"{token}ws", "http://evil.example", False),
        ("/guess/ws", own, False),
        ("/ws", own, False),
    ):
        assert (asyncio.run(_upgraded(at, path, origin)) == 101) is known


def test_a_port_that_is_taken_is_named():
    import socket

    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(BadInput, match="port that is free"):
            free_port(other.getsockname()[1])


def test_without_the_extra_the_command_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr(command.importlib.util, "find_spec", lambda name: None)
    done = CliRunner().invoke(command.open_page, ["quick"])
    assert done.exit_code == 1
    assert done.output == "Error: the page needs the extra `page`: pip install 'rigdda[page]'\n"


def test_other_commands_do_not_import_the_page():
    code = "import sys, rigdda.app.cli; print([m for m in ('panel', 'bokeh') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_a_tab_that_is_closed_while_it_is_sent_to_is_no_error():
    told = []
    loop = types.SimpleNamespace(default_exception_handler=told.append)
    report(loop, {"exception": WebSocketClosedError()})
    other = {"exception": ValueError("other")}
    report(loop, other)
    report(loop, {"message": "no exception"})
    assert told == [other, {"message": "no exception"}]
