"""Draw the pictures of the documentation: `python docs/pictures.py` writes them as PNG."""

from __future__ import annotations

import re
from pathlib import Path

import gymnasium
from matplotlib.image import imsave

import rigdda.envs
from rigdda import Barrier, Ditch, Fence, Site
from rigdda.app.reports import pictures
from rigdda.app.reports.simulation_folder import along
from rigdda.app.reports.stations import Passing, summary
from rigdda.envs.corridor_environment import CorridorDesign
from rigdda.files import atomic
from rigdda.passages import passages

DOCS = Path(__file__).parent
LAYOUT: tuple[Barrier, ...] = (Fence(17.0, 3.0, energy_class=1000), Ditch(30.3, 1.0, 3.0))


def design(path: Path) -> None:
    """Draw what `rigdda/BarrierDesign-v0` renders after its one step."""
    env = gymnasium.make("rigdda/BarrierDesign-v0", site="quick", max_barriers=2, releases=12,
                         render_mode="rgb_array")  # fmt: skip
    env.reset(seed=0)
    env.step(rigdda.envs.DesignProblem("quick", max_barriers=2).encode(LAYOUT).astype("float32"))
    _write(path, env)


def placement(path: Path) -> None:
    """Draw what `rigdda/BarrierPlacement-v0` renders after its first barrier."""
    env = gymnasium.make("rigdda/BarrierPlacement-v0", site="quick", max_barriers=2, releases=12,
                         render_mode="rgb_array")  # fmt: skip
    env.reset(seed=0)
    problem = rigdda.envs.DesignProblem("quick", max_barriers=1)
    env.step(problem.encode(LAYOUT[:1]).astype("float32"))
    _write(path, env)


def corridor(path: Path) -> None:
    """Draw what `rigdda/Corridor-v0` renders after its first section."""
    env = CorridorDesign(site=["verge", "quick"], budget=2000.0, render_mode="rgb_array")
    env.reset(seed=3)
    ditch = Ditch(env.problem.site.slope.toe, 1.5, 4.0)
    env.step(env.slots.encode(env.problem, env.problem.check((ditch,))))
    _write(path, env)


def tutorial(path: Path) -> None:
    """Draw what the first command of the tutorial for the engineer draws."""
    page = (DOCS / "tutorials/engineer.md").read_text(encoding="utf-8")
    block = re.search(r"```toml\n(.*?)```", page, re.DOTALL)
    assert block
    site = Site.parse(block[1], "my-slope.toml")
    lines = along(site)
    found = passages(site, (), [(seed, None) for seed in range(200)], lines.tolist())
    passing = Passing.of(site, (), None, found)
    pictures.released(path, passing, (), summary(passing, range(len(lines))))


def _write(path: Path, env: gymnasium.Env) -> None:
    with atomic(path) as part:
        imsave(part, env.render(), format="png")


def main() -> None:
    """Draw them all."""
    design(DOCS / "environments/design.png")
    placement(DOCS / "environments/placement.png")
    corridor(DOCS / "environments/corridor.png")
    tutorial(DOCS / "tutorials/section.png")


if __name__ == "__main__":
    main()
