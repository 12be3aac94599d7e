"""The policy: its file, and that it always has an answer."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from rigdda import MECHANICS, BadInput, Site
from rigdda.agents.designers import policy
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.policy import TEMPERATURE, Policy, decide
from rigdda.agents.learning.forecasts import FEATURES, FORECAST_Z, of_site
from rigdda.agents.learning.relative_layouts import NOTHING, candidates, placed
from rigdda.agents.network import NAMES, WIDTH, Network, features
from rigdda.envs import DesignProblem
from rigdda.envs.observation import FIELDS, observe


def network(outputs: np.ndarray, inputs: int = WIDTH) -> Network:
    """A network that always says the same."""
    layer = (np.zeros((len(outputs), inputs), np.float32), outputs.astype(np.float32))
    zeros, ones = np.zeros(inputs, np.float32), np.ones(inputs, np.float32)
    return Network(zeros, ones, [layer], {})


def seen_at(problem: DesignProblem) -> np.ndarray:
    return features(observe(problem))


def test_features_are_what_is_seen_of_the_site(site: Site) -> None:
    problem = DesignProblem(site)
    seen = observe(problem)
    line = features(seen)
    assert line.shape == (WIDTH,) and line.dtype == np.float32 and np.isfinite(line).all()
    assert set(seen) == set(NAMES)
    np.testing.assert_array_equal(line[: FIELDS[NAMES[0]].size], seen[NAMES[0]])


def test_a_network_survives_its_file(site: Site, tmp_path: Path) -> None:
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


@pytest.mark.parametrize("content", [None, b"", b"no tensors"])
def test_another_file_is_refused(content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / "it.safetensors"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(BadInput, match="rigdda train"):
        Network.load(file)


DITCH = '[{"kind": "ditch", "depth": 2.0, "width": 5.0, "station": 1.0}]'
FENCE = '[{"kind": "fence", "height": 3.0, "energy_class": 500, "station": 0.0}]'
BOTH = "[" + FENCE[1:-1] + ", " + DITCH[1:-1] + "]"
CATALOGUE = (NOTHING, DITCH, FENCE, BOTH)


def preferring(weights: dict[int, float]) -> Policy:
    """Return a policy whose score of a layout is a weighted sum of its features."""
    row = np.zeros((1, FEATURES), np.float32)
    row[0, FORECAST_Z] = 1.0 / TEMPERATURE  # the correction cancels the score by the forecast
    for place, weight in weights.items():
        row[0, place] += weight
    zeros, ones = np.zeros(FEATURES, np.float32), np.ones(FEATURES, np.float32)
    return Policy(Network(zeros, ones, [(row, np.zeros(1, np.float32))], {}), CATALOGUE)


COST = 0
"""Number of the feature that is the annual cost over Z without barriers."""


def test_the_layout_with_the_highest_score_is_built(site: Site) -> None:
    problem = DesignProblem(site)
    found = of_site(problem, CATALOGUE)
    least = decide(preferring({FORECAST_Z: -1.0}), problem)
    assert least == found.layouts[int(np.nanargmin(found.z))] != ()
    assert decide(preferring({COST: -1.0}), problem) == ()
    dearest = decide(preferring({COST: 1.0}), problem)
    assert [barrier.kind for barrier in dearest] == ["fence", "ditch"]


def test_features_begin_with_cost_risk_and_forecast(site: Site) -> None:
    problem = DesignProblem(site)
    found = of_site(problem, CATALOGUE)
    for layout, row, z in zip(found.layouts, found.features, found.z, strict=True):
        assert layout is not None
        assert row[0] == pytest.approx(site.annual(layout) / problem.nothing.objective)
        assert row[0] + row[1] == pytest.approx(row[2]) == pytest.approx(z)
    assert found.z[0] == pytest.approx(1.0) and (found.z[1:] < 1.0).any()


def test_only_layouts_that_a_problem_allows_are_built(site: Site) -> None:
    dearest = preferring({COST: 1.0})
    assert [b.kind for b in decide(dearest, DesignProblem(site, 1))] == ["fence"]
    assert [b.kind for b in decide(dearest, DesignProblem(site, kinds=("ditch",)))] == ["ditch"]
    assert decide(dearest, DesignProblem(site, kinds=("wall",))) == ()
    assert decide(dearest, DesignProblem(site, max_cost=0.5)) == ()
    zone = site.barrier_zone
    middle = 0.5 * (zone.start + zone.end)
    problem = DesignProblem(site, zone=(middle, zone.end))
    layout = decide(dearest, problem)
    assert layout[0].x >= middle and problem.fits(layout)


def test_every_candidate_is_understood(site: Site) -> None:
    menu = Menu(DesignProblem(site))
    listed = candidates()
    assert listed[0] == NOTHING and len(set(listed)) == len(listed)
    found = [placed(menu, relative) for relative in listed]
    assert found[0] == () and sum(layout is not None for layout in found) > 100
    with pytest.raises(BadInput, match="layouts"):
        placed(menu, '[{"kind": "fence", "tall": 1.0, "station": 0.0}]')
    with pytest.raises(BadInput, match="layouts"):
        placed(menu, "[1]")


def test_a_policy_survives_its_file_and_needs_no_torch(tmp_path: Path) -> None:
    file = tmp_path / "it.safetensors"
    preferring({COST: 1.0}).save(file)
    read = policy.load(file)
    assert read.layouts == CATALOGUE and read.network.notes == {}
    code = (
        "import sys; sys.modules['torch'] = sys.modules['stable_baselines3'] = None\n"
        "from rigdda.envs import DesignProblem; from rigdda.agents.designers import policy\n"
        "from rigdda import agents\n"
        f"found = policy.using(policy.load({str(file)!r}))(DesignProblem('quick'), 8)\n"
        "assert found.simulations <= 8 and len(found.history.entries) == 1\n"
        "assert [b.kind for b in found.layout] == ['fence', 'ditch']\n"
        "assert agents.policy.design(DesignProblem('quick'), 8).simulations <= 8\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_policy_that_ships_says_how_it_was_made() -> None:
    notes = policy.load().network.notes
    assert notes["command"].startswith("rigdda train") and notes["mechanics"] == MECHANICS


SHAPE = "not a policy of this version"


def test_a_policy_that_imitates_forecasts_is_refused(tmp_path: Path) -> None:
    """Earlier policies had their catalogue under another key, and scores without the forecast."""
    now = preferring({COST: 1.0})
    notes = {"layouts": json.dumps(CATALOGUE)}
    earlier = Network(now.network.mean, now.network.scale, now.network.layers, notes)
    earlier.save(tmp_path / "earlier.safetensors")
    with pytest.raises(BadInput, match=SHAPE):
        policy.load(tmp_path / "earlier.safetensors")


def test_a_network_of_another_shape_is_refused(tmp_path: Path) -> None:
    network(np.zeros(9), 4).save(tmp_path / "small.safetensors")
    with pytest.raises(BadInput, match=SHAPE):
        policy.load(tmp_path / "small.safetensors")


@pytest.mark.parametrize(
    "change, words",
    [
        ({"mean": np.float32(0.0)}, SHAPE),
        ({"bias": np.float32(0.0)}, SHAPE),
        ({"bias": np.full(1, np.nan)}, "finite numbers"),
        ({"weight": np.full((1, FEATURES), np.inf)}, "finite numbers"),
        ({"scale": np.zeros(FEATURES)}, "positive scales"),
    ],
)
def test_a_damaged_network_is_refused(
    change: dict[str, np.ndarray], words: str, tmp_path: Path
) -> None:
    whole = {"mean": np.zeros(FEATURES), "scale": np.ones(FEATURES)}
    whole |= {"weight": np.zeros((1, FEATURES)), "bias": np.zeros(1)} | change
    names = {"weight": "weight 0", "bias": "bias 0"}
    file = tmp_path / "damaged.safetensors"
    save_file({names.get(k, k): np.array(v, np.float32) for k, v in whole.items()}, file)
    with pytest.raises(BadInput, match=f"policy = .*damaged.*{words}"):
        policy.load(file)
