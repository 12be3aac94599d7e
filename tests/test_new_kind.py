"""A kind of barrier is one class and one line that registers it: here two kinds of a user's own."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, ClassVar

import gymnasium
import numpy as np
import pytest

from rigdda import Run, Site, load_layout, release, save_layout
from rigdda.agents.designers import module
from rigdda.app.reports.wording import order
from rigdda.barriers import KINDS, Ditch, Standing, describe
from rigdda.barriers.base import Floats, KnownSite, Metres
from rigdda.envs import DesignProblem
from rigdda.envs.encoding import decode, encode, slot_size
from rigdda.fields import about


class Gabions(Standing, frozen=True, tag="gabions"):
    """Baskets of stone, which stand on any ground."""

    thickness: Annotated[Metres, about("Extent downhill of `x`.", "m")] = 1.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        return 150.0 * self.height * self.thickness

    def sizes(self, metres: Callable[[float], str]) -> str:
        return f"{metres(self.height)} high, {metres(self.thickness)} thick"


class LinedDitch(Ditch, frozen=True, tag="lined_ditch"):
    """A ditch whose floor is paved."""

    steepest: ClassVar[float | None] = 20.0

    def price(self, site: KnownSite, outline: Floats | None) -> float:
        return super().price(site, outline) + 30.0 * self.width


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KINDS, "gabions", Gabions)
    monkeypatch.setitem(KINDS, "lined_ditch", LinedDitch)


@pytest.fixture
def problem() -> DesignProblem:
    return DesignProblem(Site.load("verge"), kinds=("gabions", "lined_ditch"), max_barriers=2)


def test_it_is_written_and_read(tmp_path: Path) -> None:
    layout = Gabions(12.0, 2.0), LinedDitch(15.0, 1.0, 4.0)
    save_layout(layout, tmp_path / "layout.toml")
    assert load_layout(tmp_path / "layout.toml") == layout
    assert describe(layout[0]) == "gabions at 12.0 m, 2.0 m high, 1.0 m thick"


def test_it_stops_rock_and_has_a_price(problem: DesignProblem, tmp_path: Path) -> None:
    site, zone = problem.site, problem.zone
    wall = Gabions(zone.end - 1.5, zone.max_height)
    assert site.capital((wall,)) == pytest.approx(150.0 * wall.height * site.access(wall.x))
    assert site.annual((wall,)) == pytest.approx(
        site.capital((wall,)) * (site.prices.annuity("gabions") + 0.01)
    )
    assert problem.check((wall,)) == (wall,)
    kinds = DesignProblem(site, kinds=("wall",))
    rigid = KINDS["wall"](x=wall.x, height=wall.height)
    here, there = (p.evaluate(w, range(64)) for p, w in ((problem, (wall,)), (kinds, (rigid,))))
    assert here.reach == there.reach and here.debris < problem.nothing.debris
    run, outcome = release(site, (wall,), 3)
    run.save(tmp_path / "run.npz")
    assert Run.load(tmp_path / "run.npz").scene.barriers == (wall,)
    run.to_rerun(tmp_path / "run.rrd")
    assert outcome.barriers[0].state == "stands" and "gabions" in order(wall, site)


def test_vectors_stand_for_it(problem: DesignProblem) -> None:
    rng, size = np.random.default_rng(0), 2 * slot_size(problem.kinds)
    found = [decode(problem.place, rng.uniform(-1, 1, size), problem.kinds) for _ in range(50)]
    assert {barrier.kind for layout in found for barrier in layout} == set(problem.kinds)
    for layout in found:
        vector = encode(problem.place, layout, 2, problem.kinds)
        again = decode(problem.place, vector, problem.kinds)
        assert [describe(b, 6) for b in again] == [describe(b, 6) for b in layout]


def test_designers_and_environments_build_it(problem: DesignProblem) -> None:
    for name in ("random", "race"):
        found = module(name).design(problem, 400, seed=2)
        assert found.layout and {barrier.kind for barrier in found.layout} <= set(problem.kinds)
    env = gymnasium.make("rigdda/BarrierPlacement-v0", site="verge", kinds=problem.kinds)
    env.action_space.seed(0)
    layouts = []
    for seed in range(4):
        env.reset(seed=seed)
        layouts.append(env.step(env.action_space.sample())[4]["layout"])
    assert any(layouts)
