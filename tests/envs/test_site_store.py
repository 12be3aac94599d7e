"""What is known of a site without barriers is simulated once, not once a process."""

from __future__ import annotations

import lzma
from pathlib import Path

import msgspec
import numpy as np
import pytest
from cases import cut

import rigdda
from rigdda.envs import ensemble, envelope, outcome_cache, site_store
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
    monkeypatch.setattr(ensemble, "FIRST", 4)
    monkeypatch.setattr(ensemble, "ALL", 40)
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


def ship(cache: Path, sources: str | None = None) -> tuple[ensemble.Ensemble, envelope.Envelope]:
    """Write the file of the package, empty the user's cache; return what it holds."""
    found, seen = known()
    key = DesignProblem(CUT).key.hex()
    packed = site_store.pack(
        {f"ensemble-{key}": found, f"envelope-{key}": envelope.StoredEnvelope.of(seen)}
    )
    if sources is not None:
        content = msgspec.msgpack.decode(lzma.decompress(packed), type=site_store.Content)
        other = msgspec.structs.replace(content, sources=sources)
        packed = lzma.compress(msgspec.msgpack.encode(other))
    site_store.SHIPPED.write_bytes(packed)
    for path in [*cache.rglob("*.msgpack")]:
        path.unlink()
    return found, seen


def test_a_first_reset_reads_what_ships(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, seen = ship(cache)
    forget(monkeypatch)
    no_simulation(monkeypatch)
    again, seen_again = known()
    assert again == first and same(seen_again, seen)
    monkeypatch.setattr(BarrierPlacement, "looks", False)
    BarrierPlacement(CUT, releases=1).draw(seed=0)
    assert not [*cache.rglob("*.msgpack")]


@pytest.mark.parametrize("what", ["other sources", "damaged", "cut off"])
def test_what_ships_is_ignored_unless_it_is_sound_and_of_these_sources(
    what: str, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = ship(cache, "0" * 16 if what == "other sources" else None)
    if what != "other sources":
        whole = site_store.SHIPPED.read_bytes()
        site_store.SHIPPED.write_bytes(whole[:-40] if what == "cut off" else b"nothing")
    forget(monkeypatch)
    simulate, asked = ensemble._simulate, []
    monkeypatch.setattr(
        ensemble, "_simulate", lambda *given: asked.append(given) or simulate(*given)
    )
    again, _ = known()
    assert len(asked) == 1 and again == first


def test_modules_that_are_named_exist() -> None:
    """A module that is renamed would no longer be part of the hash, or would be by mistake."""
    here, whole = Path(ensemble.__file__).parent, Path(rigdda.__file__).parent
    assert all((here / f"{name}.py").is_file() for name in site_store.STATISTICS)
    parts = {part for path in whole.rglob("*.py") for part in path.with_suffix("").parts}
    assert {*site_store.UNRELATED} <= parts | {path.name for path in whole.iterdir()}
