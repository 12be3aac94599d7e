"""Steps per second of `rigdda/BarrierForecast-v0` with a plain loop, a short script and SB3's PPO.

`python -m experiments.throughput_forecast [--quick] [--out DIR]`. The loop steps a batch with
random actions that the mask allows. The script is a policy gradient on a batch in the style of
CleanRL, and Stable-Baselines3's PPO learns on `rigdda.envs.sb3_vec_env` with its default network.
Times are processor time of one thread, which other jobs affect less than elapsed time. Writes
throughput_forecast.csv. Judged by the least number of steps per second of processor time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO

import rigdda.envs
from experiments.script import Number, main, say, write
from rigdda.envs import forecast_table

NAME = "rigdda/BarrierForecast-v0"
COPIES = 256
"""Number of copies in a batch."""
STEPS, QUICK_STEPS = 200_000, 20_000
"""Number of steps of each run."""


def batch() -> gymnasium.vector.VectorEnv:
    """Return a batch with flat observations."""
    mode = "vector_entry_point"
    return gymnasium.make_vec(NAME, COPIES, vectorization_mode=mode, site="train", flat=True)


def plain_loop(steps: int) -> float:
    """Step a batch with random actions; return the mean reward."""
    env, rng, total = batch(), np.random.default_rng(0), 0.0
    _, infos = env.reset(seed=0)
    for _ in range(steps // COPIES):
        chances = rng.random(infos["action_mask"].shape) * infos["action_mask"]
        _, rewards, _, _, infos = env.step(chances.argmax(axis=1))
        total += float(rewards.sum())
    return total / (steps // COPIES * COPIES)


def script(steps: int) -> float:
    """Train a small policy by the policy gradient; return the mean reward of the last tenth."""
    env = batch()
    torch.manual_seed(0)
    seen, infos = env.reset(seed=0)
    width, actions = seen.shape[1], infos["action_mask"].shape[1]
    net = torch.nn.Sequential(
        torch.nn.Linear(width, 64), torch.nn.Tanh(), torch.nn.Linear(64, actions)
    )
    optimiser = torch.optim.Adam(net.parameters(), lr=3e-3)
    rewards_seen = []
    for _ in range(steps // COPIES):
        mask = torch.tensor(infos["action_mask"] > 0)
        logits = net(torch.tensor(seen)).masked_fill(~mask, -torch.inf)
        chance = torch.distributions.Categorical(logits=logits)
        chosen = chance.sample()
        seen, rewards, _, _, infos = env.step(chosen.numpy())
        rewards_seen.append(float(rewards.mean()))
        advantage = torch.tensor(rewards - rewards.mean(), dtype=torch.float32)
        optimiser.zero_grad()
        (-advantage * chance.log_prob(chosen)).mean().backward()
        optimiser.step()
    return float(np.mean(rewards_seen[-max(1, len(rewards_seen) // 10) :]))


def ppo(steps: int) -> float:
    """Train PPO of Stable-Baselines3; return its mean reward on the training sites."""
    copies = rigdda.envs.sb3_vec_env(NAME, COPIES, site="train", flat=True)
    terms: dict[str, Any] = {
        "n_steps": 8, "batch_size": 512, "n_epochs": 4, "gamma": 1.0, "seed": 0,
    }  # fmt: skip
    model = PPO("MlpPolicy", copies, learning_rate=1e-3, device="cpu", **terms)
    model.learn(steps)
    table = forecast_table.load()
    rows = table.rows("train")
    actions, _ = model.predict(table.observation[rows], deterministic=True)
    return float(table.reward[rows, actions].mean())


RUNS: dict[str, Callable[[int], float]] = {
    "plain loop": plain_loop,
    "script": script,
    "PPO of SB3": ppo,
}


def run(quick: bool, out: Path) -> Number:
    """Write throughput_forecast.csv."""
    torch.set_num_threads(1)
    steps = QUICK_STEPS if quick else STEPS
    rows: list[dict[str, Any]] = []
    for name, play in RUNS.items():
        start, begun = time.process_time(), time.perf_counter()
        reward = play(steps)
        spent, lasted = time.process_time() - start, time.perf_counter() - begun
        rows.append({
            "run": name, "steps": steps, "steps_per_cpu_s": round(steps / spent),
            "steps_per_s": round(steps / lasted), "reward": round(reward, 4),
        })  # fmt: skip
        say(f"{name}: {steps / spent:,.0f} steps per second of processor time, reward {reward:.3f}")
    write(out / "throughput_forecast.csv", rows)
    least = min(row["steps_per_cpu_s"] for row in rows)
    return Number("steps per second of processor time, the least of the runs", least, low=5000.0)


if __name__ == "__main__":
    main(run)
