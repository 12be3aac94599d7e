"""Training, small but real: PPO on a pool of sites, and going on after a kill."""

from __future__ import annotations

import shutil
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from processes import refused, rig, run

from rigdda import sites
from rigdda.agents import policy, training
from rigdda.agents.designers import ppo
from rigdda.agents.policy import SLOTS, WIDTH, Network, decide
from rigdda.envs import DesignProblem

SMALL = ("--sites", 2, "--episodes", 16)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder and the words of a small training."""
    folder = tmp_path_factory.mktemp("trained")
    return folder, run("train", *SMALL, "--out", folder, folder=folder)


@pytest.mark.slow
def test_a_training_leaves_a_policy_and_its_logs(trained: tuple[Path, str]) -> None:
    folder, words = trained
    assert list((folder / "ppo_0").glob("events.out.tfevents*"))
    notes = Network.load(folder / "policy.safetensors").notes
    assert notes["command"] == "rigdda train --sites 2 --episodes 16 --seed 0"
    assert "before" in words and "after" in words


@pytest.mark.slow
def test_a_policy_is_tried_on_unseen_sites(trained: tuple[Path, str], tmp_path: Path) -> None:
    """On the built-in site quick, which no training sees, by the designer that loads the file."""
    design = policy.using(policy.load(trained[0] / "policy.safetensors"))
    posed = DesignProblem("quick")
    found = design(posed, 30, seed=1)
    assert posed.fits(found.layout) and found.simulations == 30
    assert found.evaluation.releases == 30 and len(found.history.entries) == 1
    assert design(posed, 30, seed=1) == found


@pytest.mark.slow
def test_a_killed_training_goes_on(trained: tuple[Path, str], tmp_path: Path) -> None:
    more = (*SMALL[:2], "--episodes", 64)
    killed = rig("train", *more, "--out", "o", folder=tmp_path)
    checkpoint = tmp_path / "o/checkpoint.zip"
    while not checkpoint.is_file():
        assert killed.poll() is None
        time.sleep(0.02)
    killed.kill()
    killed.communicate()
    assert run("train", *more, "--out", "o", folder=tmp_path).startswith(
        "mean relative reduction of Z"
    )
    assert ppo.PPO.load(checkpoint).num_timesteps == 64
    last = Network.load(tmp_path / "o/policy.safetensors").layers[-1][0]
    assert (last != Network.load(trained[0] / "policy.safetensors").layers[-1][0]).any()
    line = refused("train", *more, "--seed", 1, "--out", "o", folder=tmp_path)
    assert "seed = 1" in line and "another folder" in line


@pytest.mark.slow
@pytest.mark.parametrize("rollouts", [1, 5])
def test_a_training_that_was_stopped_ends_as_if_it_had_not_been(
    rollouts: int, tmp_path: Path
) -> None:
    terms = training.Terms(2, 40, 3)
    whole = training.train(terms, tmp_path / "whole", lambda done: None)

    def stop(done: int) -> None:
        if done > 4 * rollouts:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        training.train(terms, tmp_path / "stopped", stop)
    np.random.seed(99)  # noqa: NPY002
    seen: list[int] = []
    rest = training.train(terms, tmp_path / "stopped", seen.append)
    assert seen[0] == 4 * rollouts + 2
    for (weight, bias), (other, last) in zip(
        whole.network.layers, rest.network.layers, strict=True
    ):
        assert (weight == other).all() and (bias == last).all()
    files = [tmp_path / name / "policy.safetensors" for name in ("whole", "stopped")]
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.slow
def test_a_training_goes_on_with_more_episodes(trained: tuple[Path, str], tmp_path: Path) -> None:
    folder = tmp_path / "o"
    shutil.copytree(trained[0], folder)
    before = Network.load(folder / "policy.safetensors").layers[-1][0]
    run("train", *SMALL[:2], "--episodes", 32, "--out", folder, folder=tmp_path)
    assert ppo.PPO.load(folder / "checkpoint.zip").num_timesteps == 32
    after = Network.load(folder / "policy.safetensors")
    assert (after.layers[-1][0] != before).any()
    one = "rigdda train --sites 2 --episodes {} --seed 0"
    assert after.notes["command"] == f"{one.format(16)}; {one.format(32)}"
    line = refused("train", *SMALL, "--out", folder, folder=tmp_path)
    assert "episodes = 16: give at least 32" in line and "another folder" in line


def test_bad_terms_are_one_line(tmp_path: Path) -> None:
    line = refused("train", "--sites", 100_000, folder=tmp_path)
    assert "sites" in line and "100000" in line
    line = refused("evaluate", "--policy", "none.safetensors", folder=tmp_path)
    assert "none.safetensors" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name, content",
    [
        ("training.json", b"{"),
        ("training.json", b"\xff"),
        ("checkpoint.zip", b"no archive"),
        ("checkpoint.zip", None),
    ],
)
def test_a_damaged_training_is_one_line(name: str, content: bytes | None, tmp_path: Path) -> None:
    file = tmp_path / name
    if content is None:  # sound, but of something else
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("data", "x")
    else:
        file.write_bytes(content)
    line = refused("train", *SMALL, "--out", ".", folder=tmp_path)
    assert name in line and "another folder" in line
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.slow
def test_a_checkpoint_without_its_terms_is_one_line(
    trained: tuple[Path, str], tmp_path: Path
) -> None:
    (tmp_path / "checkpoint.zip").write_bytes((trained[0] / "checkpoint.zip").read_bytes())
    line = refused("train", *SMALL, "--out", ".", folder=tmp_path)
    assert "training.json" in line and "missing" in line and "another folder" in line


@pytest.mark.slow
def test_a_checkpoint_cut_off_is_one_line(trained: tuple[Path, str], tmp_path: Path) -> None:
    for name in ("training.json", "checkpoint.zip"):
        (tmp_path / name).write_bytes((trained[0] / name).read_bytes())
    file = tmp_path / "checkpoint.zip"
    file.write_bytes(file.read_bytes()[:-1000])
    line = refused("train", *SMALL, "--out", ".", folder=tmp_path)
    assert "checkpoint.zip" in line and "another folder" in line


class Toy(ppo.VecEnv):
    """Four features, a policy's numbers, and a reward for the first number being 0.8."""

    def __init__(self, copies: int = 16):
        from gymnasium import spaces

        box = spaces.Box(-np.inf, np.inf, (4,), np.float32)
        super().__init__(copies, box, spaces.Box(-1.0, 1.0, (SLOTS.size,), np.float32))
        self.seen = np.zeros((copies, 4), np.float32)

    def reset(self) -> np.ndarray:
        return self.seen

    def step_async(self, actions: np.ndarray) -> None:
        self.actions = actions

    def step_wait(self):
        reward = -np.abs(self.actions[:, 0] - 0.8).astype(np.float32)
        done = np.ones(self.num_envs, dtype=bool)
        infos = [{"terminal_observation": seen} for seen in self.seen]
        return self.seen, reward, done, infos

    def close(self) -> None: ...

    def get_attr(self, attr_name, indices=None):
        return [None] * self.num_envs

    def set_attr(self, attr_name, value, indices=None) -> None: ...

    def env_method(self, method_name, *args, indices=None, **kwargs):
        return [None] * self.num_envs

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * self.num_envs


def test_ppo_learns_and_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
    toy, file = Toy(), tmp_path / "checkpoint.zip"
    zeros, ones = np.zeros(4, np.float32), np.ones(4, np.float32)
    model = ppo.learner(toy, 0, tmp_path)
    seen: list[int] = []
    ppo.learn(model, 16 * 4 * 3, file, seen.append)
    before = ppo.export(model, zeros, ones, {})(zeros)[0]
    kept = ppo.resume(file, toy)
    assert kept.num_timesteps == 16 * 4 * 3
    ppo.learn(kept, 16 * 4 * 60, file, seen.append)
    after = ppo.export(kept, zeros, ones, {})(zeros)[0]
    assert abs(after - 0.8) < abs(before - 0.8) - 0.05
    assert seen[-1] == 16 * 4 * 60


def test_the_exported_network_says_what_torch_says(tmp_path: Path) -> None:
    model = ppo.learner(Toy(), 0, tmp_path)
    mean, scale = np.arange(1.0, 5.0, dtype=np.float32), np.array([2, 1, 0.5, 4], np.float32)
    made = ppo.export(model, mean, scale, {})
    for seen in (np.zeros(4, np.float32), np.ones(4, np.float32)):
        said, _ = model.predict(seen, deterministic=True)
        np.testing.assert_allclose(made(mean + scale * seen), said, atol=1e-5)
    assert (made(mean) != made(mean + scale)).any()


@pytest.mark.slow
def test_a_training_that_is_done_is_not_done_again(
    trained: tuple[Path, str], tmp_path: Path
) -> None:
    folder = tmp_path / "o"
    shutil.copytree(trained[0], folder)
    before = (folder / "policy.safetensors").read_bytes()
    seen: list[int] = []
    training.train(training.Terms(2, 16, 0), folder, lambda done, *_: seen.append(done))
    assert seen == [] and (folder / "policy.safetensors").read_bytes() == before


NAMES = sites.split(training.SPLIT)[:2]


@pytest.fixture
def featured() -> ppo.Featured:
    zeros, ones = np.zeros(WIDTH, np.float32), np.ones(WIDTH, np.float32)
    return ppo.Featured(ppo.pool(NAMES, training.FIDELITY), zeros, ones)


@pytest.mark.slow
def test_every_copy_of_the_pool_keeps_its_site() -> None:
    copies = ppo.pool(NAMES, training.FIDELITY)
    copies.seed(0)
    first = copies.reset()
    nothing = np.full((2, SLOTS.size), -1.0)
    for _ in range(2):
        second, rewards, done, infos = copies.step(nothing)
        assert done.all() and not rewards.any()
        assert [info["site"] for info in infos] == NAMES
        assert (first["profile"] == second["profile"]).all()
    assert (first["profile"][0] != first["profile"][1]).any()


def test_an_action_of_nothing_builds_what_the_policy_starts_from(featured: ppo.Featured) -> None:
    assert featured.reset().shape == (2, WIDTH)
    _, _, _, infos = featured.step(np.zeros((2, SLOTS.size), np.float32))
    layer = np.zeros((SLOTS.size, WIDTH), np.float32), np.zeros(SLOTS.size, np.float32)
    zeros, ones = np.zeros(WIDTH, np.float32), np.ones(WIDTH, np.float32)
    nothing = Network(zeros, ones, [layer], {})
    for name, info in zip(NAMES, infos, strict=True):
        said = decide(nothing, training.problem(name))
        assert [barrier.kind for barrier in info["layout"]] == [barrier.kind for barrier in said]
        for built, meant in zip(info["layout"], said, strict=True):
            assert built.x == pytest.approx(meant.x, abs=1e-5)


def test_what_is_learnt_from_is_what_the_policy_sees(featured: ppo.Featured) -> None:
    seen = featured.reset()
    for name, row in zip(NAMES, seen, strict=True):
        see = np.clip(training.observed_features(training.problem(name)), -3.0, 3.0)
        np.testing.assert_allclose(row, see, rtol=1e-6)


def test_a_reward_is_what_is_better_than_usual_at_a_site(featured: ppo.Featured) -> None:
    featured.reset()
    built = np.zeros((2, SLOTS.size), np.float32)
    _, first, _, _ = featured.step(built)
    assert first.tolist() == [0.0, 0.0]
    usual = featured.usual.copy()
    _, second, _, _ = featured.step(built)
    assert featured.usual == pytest.approx(usual + ppo.RECENT * second)
