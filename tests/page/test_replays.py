"""A release is recorded for the rerun viewer and opened, or the command to open it is told."""

import sys
import time

import pytest

from rigdda import sites
from rigdda.app.page.replays import FILE, Viewing, replay_arguments


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="screens are told on Linux")
def test_without_a_screen_the_command_is_told(tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    viewing = Viewing(tmp_path)
    assert viewing.look() == ""
    asked = replay_arguments(tmp_path / "site.toml", None, "block", 3)
    assert asked[-2:] == ["--seed", "3"]
    viewing.open(asked, "texts")
    assert viewing.look() == "The release is being recorded."
    latest = time.monotonic() + 120.0
    while "did not start" not in (words := viewing.look()):
        assert time.monotonic() < latest, words
        time.sleep(0.05)
    (file,) = tmp_path.glob(f"replay-*/{FILE}")
    assert file.read_bytes().startswith(b"RRF")
    assert "there is no screen" in words
    assert words.endswith(f"rerun {file}")
    before = file.stat().st_mtime_ns
    viewing.open(asked, "texts")
    viewing.look()
    viewing.close()
    assert file.stat().st_mtime_ns == before


def test_a_release_that_cannot_be_recorded_tells_why(tmp_path):
    (tmp_path / "site.toml").write_text(sites.text("quick"), encoding="utf-8")
    viewing = Viewing(tmp_path)
    viewing.open(replay_arguments(tmp_path / "site.toml", None, "nothing", 0), "")
    latest = time.monotonic() + 120.0
    while "not recorded" not in (words := viewing.look()):
        assert time.monotonic() < latest, words
        time.sleep(0.05)
    assert "nothing" in words
