"""What is known of a site without barriers is simulated once, not once a process."""

from __future__ import annotations

import hashlib
import lzma
import os
import shutil
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from cases import cut
from click.testing import CliRunner, Result

import rigdda
from experiments import known_sites
from rigdda import kernel
from rigdda.envs import (
    cost,
    design_envelope,
    ensemble,
    envelope,
    intervals,
    outcome_cache,
    quantiles,
    site_store,
)
from rigdda.envs.environments import BarrierPlacement
from rigdda.envs.outcome_cache import Memory
from rigdda.envs.problem import DesignProblem

CUT = cut()


def forget(patch: pytest.MonkeyPatch) -> None:
    """Forget what this process knows, as a new one would."""
    patch.setattr(ensemble, "memory", Memory(4))
    patch.setattr(envelope, "memory", Memory(4))
    site_store._shipped.cache_clear()


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's cache of its own, and no file of the package; few releases tell of a site."""
    monkeypatch.setattr(site_store, "cache_directory", lambda: tmp_path / "cache" / "kernels")
    monkeypatch.setattr(site_store, "SHIPPED", tmp_path / "shipped.xz")
    monkeypatch.setattr(ensemble, "FIRST_ROUND", 4)
    monkeypatch.setattr(ensemble, "BOTH_ROUNDS", 40)
    forget(monkeypatch)
    yield tmp_path / "cache"
    site_store._shipped.cache_clear()


def known() -> tuple[ensemble.Ensemble, envelope.Envelope]:
    """Return what is known of a site."""
    return ensemble.of(CUT, DesignProblem(CUT).key), envelope.envelope(CUT)


def same(one: envelope.Envelope, other: envelope.Envelope) -> bool:
    names = ("often", "energy", "bounce", "deposit")
    return all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


def no_simulation(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(ensemble, "_simulate", lambda *_: pytest.fail("simulated an ensemble"))
    patch.setattr(envelope, "_transit", lambda *_: pytest.fail("simulated an envelope"))


def test_another_process_reads_what_was_simulated(monkeypatch: pytest.MonkeyPatch) -> None:
    first, seen = known()
    forget(monkeypatch)
    no_simulation(monkeypatch)
    again, seen_again = known()
    assert again == first and same(seen_again, seen)
    with pytest.raises(ValueError, match="read-only"):
        seen_again.energy[0] = 0.0


def test_other_prices_and_rates_simulate_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcome_cache, "bare_outcomes", Memory(0))
    first = ensemble.of(CUT, DesignProblem(CUT).key)
    often = tuple(msgspec.structs.replace(event, rate=2.0 * event.rate) for event in CUT.events)
    prices = msgspec.structs.replace(CUT.prices, removal=2.0 * CUT.prices.removal)
    other = msgspec.structs.replace(CUT, name="other", events=often, prices=prices)
    monkeypatch.setattr(outcome_cache, "_simulate", lambda *_: pytest.fail("simulated a release"))
    again = ensemble.of(other, DesignProblem(other).key)
    assert again.nothing.objective == pytest.approx(2.0 * first.nothing.objective)
    assert again.shares == pytest.approx(first.shares)
    assert again.nothing.simulated == first.nothing.simulated


@pytest.mark.parametrize("found", ["damaged", "shorter"])
def test_stored_releases_are_completed(
    found: str, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts = {"small": 6, "block": 4}
    whole = ensemble.bare_outcomes(CUT, counts)
    (path,) = cache.rglob(f"*{ensemble._bare_key(CUT, 'small').hex()}.msgpack")
    kept = b"damaged" if found == "damaged" else outcome_cache.pack(whole["small"][:2])
    path.write_bytes(msgspec.msgpack.encode(kept))
    monkeypatch.setattr(outcome_cache, "bare_outcomes", Memory(0))
    assert ensemble.bare_outcomes(CUT, counts) == whole
    (again,) = cache.rglob(f"*{ensemble._bare_key(CUT, 'small').hex()}.msgpack")
    assert outcome_cache.unpack(msgspec.msgpack.decode(again.read_bytes())) == whole["small"]


def ship(cache: Path, **changes: object) -> tuple[ensemble.Ensemble, envelope.Envelope]:
    """Write the file of the package, empty the user's cache; return what it holds."""
    found, seen = known()
    key = DesignProblem(CUT).key.hex()
    packed = site_store.pack(
        {f"ensemble-{key}": found, f"envelope-{key}": envelope.StoredEnvelope.of(seen)}
    )
    content = msgspec.structs.replace(site_store.unpack(packed), **changes)
    site_store.SHIPPED.write_bytes(lzma.compress(msgspec.msgpack.encode(content)))
    for path in [*cache.rglob("*.msgpack")]:
        path.unlink()
    return found, seen


def test_a_first_reset_reads_what_ships(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, seen = ship(cache)
    forget(monkeypatch)
    no_simulation(monkeypatch)
    again, seen_again = known()
    assert again == first and same(seen_again, seen)
    monkeypatch.setattr(BarrierPlacement, "observes_layout", False)
    BarrierPlacement(CUT, releases=1).draw(seed=0)
    assert not [*cache.rglob("*.msgpack")]


OTHER = {"other mechanics": {"mechanics": "0ld"}, "another form": {"form": site_store.FORMAT + 1}}


@pytest.mark.parametrize("what", [*OTHER, "damaged", "cut off"])
def test_what_ships_is_ignored_unless_it_is_sound_and_of_this_version(
    what: str, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = ship(cache, **OTHER.get(what, {}))
    if what not in OTHER:
        whole = site_store.SHIPPED.read_bytes()
        site_store.SHIPPED.write_bytes(whole[:-40] if what == "cut off" else b"nothing")
    forget(monkeypatch)
    simulate, asked = ensemble._simulate, []
    monkeypatch.setattr(
        ensemble, "_simulate", lambda *given: asked.append(given) or simulate(*given)
    )
    again, _ = known()
    assert len(asked) == 1 and again == first


def test_what_is_stored_is_of_one_version_of_the_mechanics(monkeypatch: pytest.MonkeyPatch) -> None:
    path = site_store.path_of(ensemble.STORED_AS, b"key")
    monkeypatch.setattr(site_store, "MECHANICS", "another")
    other = site_store.path_of(ensemble.STORED_AS, b"key")
    assert path.name == other.name and path.parent != other.parent


def test_values_that_are_computed_again_are_not_read(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ship(cache)
    forget(monkeypatch)
    key = DesignProblem(CUT).key
    assert site_store.read(ensemble.STORED_AS, key, ensemble.Ensemble) is not None
    with site_store.ignored():
        assert site_store.read(ensemble.STORED_AS, key, ensemble.Ensemble) is None
    assert site_store.read(ensemble.STORED_AS, key, ensemble.Ensemble) is not None


READER = """
import numba

numba.__version__ = "0.68.99"
from rigdda import Site, kernel
from rigdda.envs import DesignProblem, ensemble

ensemble._simulate = None
problem = DesignProblem(Site.load("quick"))
print(kernel.source_hash(), problem.nothing.objective, problem.site.description == "Renamed.")
"""


def test_another_numba_docstring_and_description_find_what_ships(tmp_path: Path) -> None:
    """A new user whose kernels have another hash reads the values of the package."""
    root = Path(rigdda.__file__).parent
    whole = tmp_path / "rigdda"
    shutil.copytree(root, whole, ignore=shutil.ignore_patterns("__pycache__"))
    site = rigdda.Site.load("quick")
    key = DesignProblem(site).key
    found = ensemble.of(site, key)
    packed = site_store.pack({f"{ensemble.STORED_AS}-{key.hex()}": found})
    (whole / "envs" / "site_store.msgpack.xz").write_bytes(packed)
    for name in ("dynamics/step.py", "envs/cost.py", "releases.py"):
        text = (whole / name).read_text()
        (whole / name).write_text(text.replace('"""', '"""Edited. ', 1))
    text = (whole / "sites" / "quick.toml").read_text()
    start, description, end = text.split('"""')
    (whole / "sites" / "quick.toml").write_text(f'{start}"""Renamed."""{end}')
    env = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", READER],
        cwd=tmp_path, env=env, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    kernels, objective, renamed = done.stdout.split()
    assert renamed == "True" and description != "Renamed." and kernels != kernel.source_hash()
    assert float(objective) == found.nothing.objective


def test_texts_of_a_site_are_not_part_of_its_key() -> None:
    texts = dict.fromkeys(outcome_cache.DESCRIPTIVE_FIELDS, "other")
    other = msgspec.structs.replace(CUT, **texts)
    assert outcome_cache.fingerprint(other) == outcome_cache.fingerprint(CUT)
    prices = msgspec.structs.replace(CUT.prices, removal=2.0 * CUT.prices.removal)
    assert outcome_cache.fingerprint(
        msgspec.structs.replace(CUT, prices=prices)
    ) != outcome_cache.fingerprint(CUT)


STORED = (
    ensemble.Ensemble, cost.Evaluation, cost.Facts, cost.Risk, intervals.Estimate, intervals.Known,
    envelope.StoredEnvelope, design_envelope.DesignEnvelope, design_envelope.EventEnvelope,
    quantiles.Quantile, rigdda.Outcome, rigdda.BarrierOutcome,
)  # fmt: skip
"""Classes of stored values."""

FORMS = {3: "9fdfb4b0a3f0d913"}
"""Hash of the fields of these classes by the version of the form."""


def test_the_version_of_the_form_changes_with_the_fields() -> None:
    fields = [(kind.__name__, list(kind.__annotations__.items())) for kind in STORED]
    assert hashlib.sha256(repr(fields).encode()).hexdigest()[:16] == FORMS[site_store.FORMAT]


def test_known_sites_are_kept_while_the_mechanics_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(known_sites, "ALWAYS", ("quick",))
    monkeypatch.setattr(rigdda.sites, "split", lambda name: [])
    said: list[str] = []
    monkeypatch.setattr(known_sites, "say", said.append)
    out = tmp_path / "out.xz"

    def run() -> Result:
        forget(monkeypatch)
        said.clear()
        return CliRunner().invoke(known_sites.main, ["--out", str(out)])

    assert run().exit_code == 0 and said[0] == "quick"
    first = site_store.unpack(out.read_bytes())
    assert first.current and len(first.values) == 2
    assert run().exit_code == 0 and said[0] == "quick is the same"
    assert site_store.unpack(out.read_bytes()).values == first.values
    monkeypatch.setattr(ensemble, "BOTH_ROUNDS", 44)
    changed = run()
    assert changed.exit_code == 1 and "change rigdda.MECHANICS" in changed.output
    monkeypatch.setattr(site_store, "MECHANICS", "another")
    assert run().exit_code == 0 and said[0] == "quick"
