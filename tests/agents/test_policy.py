"""The policy: its file, its network against torch, and that it always has an answer."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from agents import policy
from agents.crossings import ensemble
from agents.features import WIDTH, features, rule_slot
from agents.network import Network
from agents.policy import SHIPPED, anchor, decide
from agents.rule import QUANTILE, rule
from envs import DesignProblem, fidelity
from envs.observation import observe
from rigdda import BadInput, Fence, Site, __version__


def network(outputs: np.ndarray, inputs: int) -> Network:
    """A network that always says the same."""
    layer = (np.zeros((len(outputs), inputs), np.float32), outputs.astype(np.float32))
    zeros, ones = np.zeros(inputs, np.float32), np.ones(inputs, np.float32)
    return Network(zeros, ones, [layer], {})


@pytest.fixture
def fences(site: Site) -> DesignProblem:
    return DesignProblem(site)


def test_features_lie_at_the_stations_of_the_zone(fences: DesignProblem, site: Site) -> None:
    seen = features(observe(fences, ()))
    assert seen.dtype == np.float32 and np.isfinite(seen).all()
    zone, ground = site.barrier_zone, site.profile
    x = np.linspace(zone.start, zone.end, 16)
    elevation = [(ground.height(at) - ground.height(site.road.start)) / 100.0 for at in x]
    assert seen[:16] == pytest.approx(elevation, abs=0.012)  # from the 33 points of the profile
    assert seen[17:24] == pytest.approx(np.full(7, 25.0 / 20.0), abs=0.35)
    assert seen[32:35] == pytest.approx([0.12, 0.1, 10.0 / 12.0], abs=1e-6)


def test_the_shipped_policy_says_how_it_was_made() -> None:
    notes = Network.load(SHIPPED).notes
    assert notes["command"].startswith("rigdda train --sites")
    assert notes["version"] == __version__ and notes["seed"].isdigit()
    assert SHIPPED.stat().st_size < 200_000


def test_it_decides_without_torch_or_a_search() -> None:
    code = (
        "import sys; sys.modules['torch'] = sys.modules['stable_baselines3'] = None\n"
        "from envs import DesignProblem; from agents import policy\n"
        "found = policy.design(DesignProblem('quick'), 8)\n"
        "assert found.simulations == 8 and len(found.history.entries) == 1\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_policy_survives_its_file(fences: DesignProblem, tmp_path: Path) -> None:
    seen = features(observe(fences, ()))
    rng = np.random.default_rng(0)
    layers = [
        (rng.normal(0, 0.2, (8, len(seen))).astype(np.float32), np.zeros(8, np.float32)),
        (rng.normal(0, 0.5, (9, 8)).astype(np.float32), np.zeros(9, np.float32)),
    ]
    notes = {name: "3" for name in ("seed", "command", "version", "how")}
    made = Network(np.zeros_like(seen), np.ones_like(seen), layers, notes)
    made.save(tmp_path / "it.safetensors")
    read = Network.load(tmp_path / "it.safetensors")
    assert read.notes == notes and (read(seen) == made(seen)).all()
    read.save(tmp_path / "again.safetensors")
    written = [(tmp_path / f"{name}.safetensors").read_bytes() for name in ("it", "again")]
    assert written[0] == written[1]
    assert read(1e9 * seen) == pytest.approx(read(1e6 * seen))  # features are clipped


def test_a_network_that_adds_nothing_builds_nearly_what_the_rule_does() -> None:
    posed = DesignProblem(fidelity.at(Site.load("quick"), "fast"))
    zeros = network(np.zeros(9), len(features(observe(posed, ()))))
    (fence,) = decide(zeros, posed)
    crossings = ensemble(posed.site, range(16))
    (ruled,) = rule(posed.site, crossings, "fence")
    assert isinstance(ruled, Fence) and isinstance(fence, Fence)

    def energy_at(x: float) -> float:
        k = int(np.abs(np.array(crossings.stations) - x).argmin())
        return float(np.quantile(crossings.at(k)["energy"], QUANTILE))

    # two stations may be as good as one another; the network knows fewer releases
    assert energy_at(fence.x) < 1.2 * energy_at(ruled.x)
    assert fence.height == pytest.approx(ruled.height, rel=0.3)
    assert 0.25 < fence.capacity / ruled.capacity < 4.0


def test_where_nothing_comes_the_rule_it_starts_from_builds_nothing(fences: DesignProblem) -> None:
    seen = observe(fences, ()) | {"energy": np.zeros(16, np.float32)}
    assert rule_slot(seen).tolist() == [0.0, -1.0, 0.0]


@pytest.mark.parametrize("content", [None, b"", b"no tensors"])
def test_another_file_is_refused(content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / "it.safetensors"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(BadInput, match="rigdda train"):
        Network.load(file)


@pytest.mark.parametrize("slots", [1, 2, 3, 5])
@pytest.mark.parametrize("kinds", [("fence",), ("wall", "fence")])
def test_it_fits_any_number_of_slots(slots: int, kinds: tuple[str, ...], site: Site) -> None:
    problem = DesignProblem(site, slots, kinds)
    wanted = np.array([-1, 0, 0, 0, 1.0, 0, 1, 0.5, 0])
    seen = features(observe(DesignProblem(site), ()))
    layout = decide(network(wanted - anchor(seen), len(seen)), problem)
    assert len(layout) == min(slots, 3)
    heights = sorted(b.height for b in layout if isinstance(b, Fence))
    assert heights == pytest.approx([2.5, 3.75, 5.0][-slots:])
    assert problem.decode(problem.encode(layout)) == pytest.approx(layout) or len(kinds) > 1


def test_what_it_cannot_build_or_pay_is_refused(site: Site) -> None:
    with pytest.raises(BadInput, match="= 'fence': choose one of wall"):
        policy.design(DesignProblem(site, kinds=("wall",)), 40)
    with pytest.raises(BadInput, match="simulations = 4: give at least 5"):
        policy.design(DesignProblem(site), 4)


def test_a_network_of_another_shape_is_refused(tmp_path):
    network(np.zeros(9), 4).save(tmp_path / "small.safetensors")
    with pytest.raises(BadInput, match="120 features and 9 outputs"):
        policy.load(tmp_path / "small.safetensors")


@pytest.mark.parametrize(
    "change, words",
    [
        ({"mean": np.float32(0.0)}, "120 features and 9 outputs"),
        ({"bias": np.float32(0.0)}, "120 features and 9 outputs"),
        ({"bias": np.full(9, np.nan)}, "finite numbers"),
        ({"weight": np.full((9, WIDTH), np.inf)}, "finite numbers"),
        ({"scale": np.zeros(WIDTH)}, "scales above 0"),
    ],
)
def test_a_damaged_network_is_refused(
    change: dict[str, np.ndarray], words: str, tmp_path: Path
) -> None:
    whole = {"mean": np.zeros(WIDTH), "scale": np.ones(WIDTH)}
    whole |= {"weight": np.zeros((9, WIDTH)), "bias": np.zeros(9)} | change
    names = {"weight": "weight 0", "bias": "bias 0"}
    file = tmp_path / "damaged.safetensors"
    save_file({names.get(k, k): np.array(v, np.float32) for k, v in whole.items()}, file)
    with pytest.raises(BadInput, match=f"policy = .*damaged.*{words}"):
        policy.load(file)
