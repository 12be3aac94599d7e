"""The policy: its file, and that it always has an answer."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from rigdda import BadInput, Site
from rigdda.agents import policy
from rigdda.agents.policy import ANCHOR, FEATURES, NAMES, SLOTS, Network, decide, features
from rigdda.envs import DesignProblem
from rigdda.envs.observation import FIELDS, observe


def network(outputs: np.ndarray, inputs: int = FEATURES) -> Network:
    """A network that always says the same."""
    layer = (np.zeros((len(outputs), inputs), np.float32), outputs.astype(np.float32))
    zeros, ones = np.zeros(inputs, np.float32), np.ones(inputs, np.float32)
    return Network(zeros, ones, [layer], {})


def saying(*slots: tuple[float, float, float, float, str]) -> Network:
    """A network that asks for barriers: presence, station, height, size and kind of each."""
    wanted = np.full((SLOTS.count, SLOTS.width), -1.0)
    for row, (*numbers, kind) in zip(wanted, slots, strict=False):
        row[: len(numbers)], row[len(numbers) + SLOTS.kinds.index(kind)] = numbers, 1.0
    return network(wanted.ravel() - ANCHOR)


def seen_at(problem: DesignProblem) -> np.ndarray:
    return features(observe(problem))


def test_features_are_what_is_seen_of_the_site(site: Site) -> None:
    problem = DesignProblem(site)
    seen = observe(problem)
    line = features(seen)
    assert line.shape == (FEATURES,) and line.dtype == np.float32 and np.isfinite(line).all()
    assert set(seen) == set(NAMES)
    np.testing.assert_array_equal(line[: FIELDS[NAMES[0]].size], seen[NAMES[0]])


def test_it_decides_without_torch_or_a_search(tmp_path: Path) -> None:
    file = tmp_path / "it.safetensors"
    saying((1.0, 0.5, 0.0, 0.0, "ditch")).save(file)
    code = (
        "import sys; sys.modules['torch'] = sys.modules['stable_baselines3'] = None\n"
        "from rigdda.envs import DesignProblem; from rigdda.agents import policy\n"
        f"found = policy.using(policy.load({str(file)!r}))(DesignProblem('quick'), 8)\n"
        "assert found.simulations == 8 and len(found.history.entries) == 1\n"
        "assert [b.kind for b in found.layout] == ['ditch']\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_policy_survives_its_file(site: Site, tmp_path: Path) -> None:
    seen = seen_at(DesignProblem(site))
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


def test_a_network_that_adds_nothing_builds_one_barrier(site: Site) -> None:
    assert len(decide(network(np.zeros(SLOTS.size)), DesignProblem(site))) == 1


@pytest.mark.parametrize("content", [None, b"", b"no tensors"])
def test_another_file_is_refused(content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / "it.safetensors"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(BadInput, match="rigdda train"):
        Network.load(file)


@pytest.mark.parametrize("slots", [1, 2, 3, 5])
@pytest.mark.parametrize("kinds", [None, ("fence",), ("wall", "ditch")])
def test_it_fits_any_problem(slots: int, kinds: tuple[str, ...] | None, site: Site) -> None:
    problem = DesignProblem(site, slots, kinds)
    asked = [(1.0, -0.9, -0.5, -0.9, "fence"), (1.0, 0.0, 0.0, -0.9, "fence")]
    layout = decide(saying(*asked, (1.0, 1.0, -0.5, -0.9, "ditch")), problem)
    assert problem.fits(layout) and len(layout) <= min(slots, 3)
    assert layout or "fence" not in problem.kinds  # a ditch finds no room on a face
    assert {barrier.kind for barrier in layout} <= set(problem.kinds) - {"wall"}


def test_what_it_cannot_build_is_refused(site: Site) -> None:
    with pytest.raises(BadInput, match=r"kinds = \('wall',\): allow a kind"):
        decide(saying(), DesignProblem(site, kinds=("wall",)))


def test_it_keeps_to_the_zone(site: Site) -> None:
    zone = site.barrier_zone
    middle = 0.5 * (zone.start + zone.end)
    problem = DesignProblem(site, zone=(middle, zone.end))
    (fence,) = decide(saying((1.0, -1.0, 0.0, -0.9, "fence")), problem)
    assert fence.x >= middle and problem.fits((fence,))


SHAPE = "no policy of this version"


def test_a_network_of_another_shape_is_refused(tmp_path: Path) -> None:
    network(np.zeros(9), 4).save(tmp_path / "small.safetensors")
    with pytest.raises(BadInput, match=SHAPE):
        policy.load(tmp_path / "small.safetensors")


@pytest.mark.parametrize(
    "change, words",
    [
        ({"mean": np.float32(0.0)}, SHAPE),
        ({"bias": np.float32(0.0)}, SHAPE),
        ({"bias": np.full(SLOTS.size, np.nan)}, "finite numbers"),
        ({"weight": np.full((SLOTS.size, FEATURES), np.inf)}, "finite numbers"),
        ({"scale": np.zeros(FEATURES)}, "positive scales"),
    ],
)
def test_a_damaged_network_is_refused(
    change: dict[str, np.ndarray], words: str, tmp_path: Path
) -> None:
    whole = {"mean": np.zeros(FEATURES), "scale": np.ones(FEATURES)}
    whole |= {"weight": np.zeros((SLOTS.size, FEATURES)), "bias": np.zeros(SLOTS.size)} | change
    names = {"weight": "weight 0", "bias": "bias 0"}
    file = tmp_path / "damaged.safetensors"
    save_file({names.get(k, k): np.array(v, np.float32) for k, v in whole.items()}, file)
    with pytest.raises(BadInput, match=f"policy = .*damaged.*{words}"):
        policy.load(file)
