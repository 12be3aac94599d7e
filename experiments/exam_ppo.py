"""Entry of the exam: PPO of Stable-Baselines3, trained in the simulator alone.

`python -m experiments.exam_ppo [--hours H] [--out DIR]` trains the policy on the simulator, without
forecasts and without the value network, for H hours of processor time (2 by default). It learns on
`rigdda/BarrierDesign-v0`, from the observation of a site to three barriers, with 4 releases in each
episode and the sites `TRAINED_ON`. The releases without barriers that the observations of these
sites need are included in the time.

Writes exam/ppo.pt, the policy, and exam/ppo.csv and exam/ppo.png, the mean reward of the episodes
in the course of the training. An interrupted training continues from the folder runs/exam_ppo. The
entry of the exam is `experiments.exam_ppo:design`; it simulates no releases.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from experiments.script import BLUE, RESULTS, draw, say, write
from rigdda import Layout, sites
from rigdda.envs import DesignProblem, sb3_vec_env
from rigdda.files import atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from stable_baselines3 import PPO

    from rigdda.app.exam.task import Task

KINDS = ("fence", "ditch", "embankment", "gravity_wall")
"""Kinds of barrier: those that every site allows, so that the action has the same size on all."""

TRAINED_ON = sites.split("wide-train")[:90]
"""Names of the sites of the training, ten of each family."""

COPIES, RELEASES = 64, 4
"""Number of copies of the environment, and of releases in an episode."""

SETTINGS: dict[str, Any] = {
    "n_steps": 16, "batch_size": 256, "n_epochs": 10, "learning_rate": 3e-4, "gamma": 1.0,
    "ent_coef": 0.003, "policy_kwargs": {"log_std_init": -0.7}, "device": "cpu", "seed": 0,
}  # fmt: skip
"""Settings of PPO; the others have their defaults."""

LEAST_REWARD = -1.0
"""Rewards below this value are raised to it. Otherwise, layouts that cost several times as much as
the damage would dominate the gradient."""

POLICY = RESULTS / "exam" / "ppo.pt"
"""File of the trained policy."""

WORK = Path("runs/exam_ppo")
"""Folder of an interrupted training: the model and the course of the training."""


def copies(names: Sequence[str]) -> Any:
    """Return the vectorised environment of the training."""
    from stable_baselines3.common.vec_env import VecEnvWrapper

    class Clipped(VecEnvWrapper):
        """Environments whose rewards are at least `LEAST_REWARD`."""

        def reset(self) -> Any:
            return self.venv.reset()

        def step_wait(self) -> Any:
            observations, rewards, done, infos = self.venv.step_wait()
            return observations, np.maximum(rewards, LEAST_REWARD), done, infos

    return Clipped(
        sb3_vec_env("rigdda/BarrierDesign-v0", COPIES, site=names, kinds=KINDS, releases=RELEASES)
    )


def train(names: Sequence[str], seconds: float, work: Path) -> tuple[PPO, list[dict[str, float]]]:
    """Train for a number of seconds of processor time, or continue an interrupted training.

    Returns
    -------
    model : PPO
        The trained model.
    course : list of dict
        For each update: processor time [s], number of episodes and mean reward of its episodes.
    """
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.logger import Logger

    torch.set_num_threads(1)
    work.mkdir(parents=True, exist_ok=True)
    kept, log = work / "model.zip", work / "course.json"
    course: list[dict[str, float]] = json.loads(log.read_text()) if log.is_file() else []
    before = course[-1]["processor_s"] if course else 0.0
    start = time.process_time()
    batch = copies(names)
    model = PPO.load(kept, batch) if course else PPO("MultiInputPolicy", batch, **SETTINGS)
    model.set_logger(Logger(None, []))  # the default one creates a temporary folder
    while not course or course[-1]["processor_s"] < seconds:
        model.learn(SETTINGS["n_steps"] * COPIES, reset_num_timesteps=False)
        rewards = model.rollout_buffer.rewards
        course.append({
            "processor_s": before + time.process_time() - start,
            "episodes": float(model.num_timesteps),
            "reward": float(rewards.mean()),
        })  # fmt: skip
        say(
            "{processor_s:,.0f} s: {episodes:,.0f} episodes, reward {reward:.3f}".format(
                **course[-1]
            )
        )
        with atomic(kept) as part, part.open("wb") as file:
            model.save(file)
        with atomic(log) as part:
            part.write_text(json.dumps(course))
    return model, course


def design(task: Task) -> Layout:
    """Return the layout that the trained policy chooses for a site. It simulates no release."""
    from stable_baselines3.common.policies import MultiInputActorCriticPolicy

    policy = MultiInputActorCriticPolicy.load(str(POLICY), device="cpu")
    action, _ = policy.predict(task.observation, deterministic=True)
    problem = DesignProblem(task.site, max_barriers=3, kinds=KINDS)
    layout = problem.decode(action)
    return layout if task.problem.fits(layout) else ()


def draw_course(path: Path, course: Sequence[dict[str, float]]) -> None:
    """Draw the mean reward of the episodes of each update against processor time."""

    def paint(sheet: Figure) -> None:
        axes = sheet.subplots()
        minutes = [row["processor_s"] / 60.0 for row in course]
        axes.plot(minutes, [row["reward"] for row in course], color=BLUE)
        axes.set(xlabel="processor time [min]", ylabel="mean reward of an update [-]")

    draw(path, (7.0, 3.5), paint)


@click.command(help=__doc__)
@click.option("--hours", type=click.FloatRange(0.0, min_open=True), default=2.0, show_default=True,
              help="Processor time of the training.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), default=RESULTS, show_default=True,
              help="Folder for the results.")  # fmt: skip
def main(hours: float, out: Path) -> None:
    """Train the policy."""
    model, course = train(TRAINED_ON, 3600.0 * hours, WORK)
    path = out / "exam" / POLICY.name
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic(path) as part:
        model.policy.save(str(part))
    write(out / "exam" / "ppo.csv", course)
    draw_course(out / "exam" / "ppo.png", course)
    last = float(np.mean([row["reward"] for row in course[-20:]]))
    click.echo(
        f"{course[-1]['episodes']:,.0f} episodes; mean reward of the last updates {last:.3f}"
    )


if __name__ == "__main__":
    main()
