"""Results that other mechanics made are listed."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from experiments import script, stale
from rigdda import MECHANICS
from rigdda.envs import site_store


def test_what_other_mechanics_made_is_listed(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(script, "MECHANICS", "0ld")
        script.write(tmp_path / "old.csv", [{"a": 1.0}])
    script.write(tmp_path / "new.csv", [{"a": 1.0}])
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "unknown.csv").write_text("a\n1\n")
    told = CliRunner().invoke(stale.main, ["--out", str(tmp_path)])
    assert told.exit_code == 1
    assert [line.split(": ")[1] for line in told.output.splitlines()] == [
        "made by unknown mechanics",
        "0ld",
    ]
    for name in ("old.csv", "bench/unknown.csv"):
        script.write(tmp_path / name, [{"a": 2.0}])
    told = CliRunner().invoke(stale.main, ["--out", str(tmp_path)])
    assert told.exit_code == 0 and not told.output


@pytest.mark.parametrize(
    ("mechanics", "form", "listed"),
    [
        (MECHANICS, site_store.FORMAT, False),
        ("0ld", site_store.FORMAT, True),
        (MECHANICS, site_store.FORMAT + 1, True),
    ],
)
def test_statistics_of_sites_are_listed(mechanics, form, listed, tmp_path, monkeypatch):
    monkeypatch.setattr(site_store, "SHIPPED", tmp_path / "shipped.xz")
    with monkeypatch.context() as patch:
        patch.setattr(site_store, "MECHANICS", mechanics)
        patch.setattr(site_store, "FORMAT", form)
        site_store.SHIPPED.write_bytes(site_store.pack({}))
    found = [what for what, _ in stale.stale_package() if "statistics" in what]
    assert bool(found) is listed
