"""Stems of a forest: energies, numbers and places that are known in closed form."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from rigdda import (
    BadInput,
    Block,
    Forest,
    Run,
    Scene,
    Settings,
    Simulation,
    Site,
    Terrain,
    lumped,
    release,
    release_outcome,
)
from rigdda.app.uncertainty.parameters import set_numbers
from rigdda.model import forest
from rigdda.model.scene import scene_from_json, scene_to_json
from rigdda.releases import Batch

from .helpers import FLAT, GRAVITY, box, incline, rock

replace = msgspec.structs.replace


def kinetic(sim: Simulation) -> float:
    return sim.energy().kinetic


def thrown(stems: list[tuple[float, float, float]], omega: float = 0.0) -> Scene:
    """Return a scene with a box at 10 m/s, 20 m above level ground, and stems as high as it."""
    block = box(0.0, 20.5, velocity=(10.0, 0.0, omega))
    return Scene(Terrain(FLAT), [block], rock(), stems=[stems])


class TestOneBlock:
    def test_a_stem_takes_its_energy_and_keeps_the_direction_and_the_spin(self) -> None:
        taken = 50e3
        plain, struck = (
            Simulation(thrown(stems, omega=3.0), Settings(dt=0.005))
            for stems in ([], [(5.0, taken, 40.0)])
        )
        for sim in (plain, struck):
            sim.step(101)  # the box is at 5.05 m
        assert kinetic(plain) - kinetic(struck) == pytest.approx(taken, rel=1e-12)
        one, other = plain.velocities[0], struck.velocities[0]
        left = math.sqrt(1.0 - taken / kinetic(plain))
        assert other == pytest.approx(left * one, rel=1e-12)
        before, after = plain.energy().impact, struck.energy().impact
        assert before - after == pytest.approx(taken, rel=1e-12)

    def test_energy_is_conserved_apart_from_what_the_stems_take(self) -> None:
        stems = [(x, 8e3, 40.0) for x in np.linspace(0.5, 9.0, 9).tolist()]
        sim = Simulation(thrown(stems, omega=-2.0), Settings(dt=0.005))
        start = sum(sim.energy()[:3])
        sim.step(250)
        now = sim.energy()
        assert sum(now[:3]) - start == pytest.approx(now.impact, rel=1e-9)
        assert -now.impact == pytest.approx(9 * 8e3)

    def test_a_stem_that_takes_all_stops_the_block_which_falls_straight_down(self) -> None:
        sim = Simulation(thrown([(5.0, 1e9, 40.0)]), Settings(dt=0.005))
        sim.step(101)
        assert kinetic(sim) < 1e-9 and sim.energy().impact < 0.0
        x = sim.poses[0, 0]
        sim.step(100)
        assert sim.poses[0, 0] == x
        assert sim.velocities[0, 1] == pytest.approx(-9.81 * 0.5)

    def test_a_block_above_the_stem_passes_it(self) -> None:
        run = [
            Simulation(thrown([(5.0, 50e3, height)]), Settings(dt=0.005)).run(0.6, 0.6).velocities
            for height in (19.0, 19.5)
        ]  # the centre is at 20.5 - 9.81 * 0.5**2 / 2 = 19.27 m when it passes
        assert run[0][-1, 0, 0] == 10.0 and run[1][-1, 0, 0] < 10.0

    def test_a_block_that_comes_back_does_not_strike_a_stem_again(self) -> None:
        """It passes the stem, returns from a wall and passes it once more."""
        block = Block(box(0.0, 0.5).vertices, velocity=(10.0, 0.0, 0.0))
        stop = box(6.0, 0.5, fixed=True)
        surfaces = rock(friction_deg=0.0, restitution=1.0)
        runs = [
            Simulation(
                Scene(Terrain(FLAT), [block, stop], surfaces, stems=[table, []]), Settings(dt=0.002)
            ).run(2.0)
            for table in ([], [(2.0, 30e3, 5.0)])
        ]
        lost = [13e4 * 1.0 - 0.5 * 2600.0 * run.velocities[-1, 0, 0] ** 2 for run in runs]
        assert all(run.velocities[-1, 0, 0] < 0.0 and run.poses[-1, 0, 0] < 2.0 for run in runs)
        assert lost[0] == pytest.approx(0.0, abs=300.0)
        assert lost[1] == pytest.approx(30e3, abs=300.0)

    @pytest.mark.parametrize("dt", [0.002, 0.01])
    def test_a_slide_has_the_speed_of_the_energy_balance(self, dt: float) -> None:
        """v^2 / 2 = g s (sin b - cos b tan phi) - n E / m, wherever the n stems stand."""
        scene, down = incline(30.0, 10.0)
        energy = 4e3
        stems = [(3.0, energy, 5.0), (3.001, energy, 5.0), (20.0, energy, 5.0)]
        sim = Simulation(
            Scene(scene.terrain, scene.blocks, scene.surfaces, stems=[stems]), Settings(dt=dt)
        )
        start = sim.poses[0, :2].copy()
        while sim.poses[0, 0] < 40.0:
            sim.step()
        way, b, phi = math.dist(start, sim.poses[0, :2]), math.radians(30.0), math.radians(10.0)
        pull = GRAVITY * (math.sin(b) - math.cos(b) * math.tan(phi))
        vx, vy, _ = sim.velocities[0]
        assert vx * vx + vy * vy == pytest.approx(
            2.0 * (way * pull - 3 * energy / 2600.0), rel=1e-3
        )
        assert vy / vx == pytest.approx(down[1] / down[0], abs=1e-6)

    def test_dense_thin_stems_act_like_a_constant_resistance(self) -> None:
        """With stems of energy E every metre, a slide at the speed limit loses E per metre."""
        scene, _ = incline(30.0, 0.0)
        per_metre = 2600.0 * GRAVITY * math.tan(math.radians(30.0))  # balances the weight
        stems = [(0.05 * k, 0.05 * per_metre, 5.0) for k in range(100, 800)]
        plain = Scene(scene.terrain, scene.blocks, scene.surfaces, stems=[stems])
        run = Simulation(plain, Settings(dt=0.005)).run(6.0)
        inside = (run.poses[:, 0, 0] > 5.5) & (run.poses[:, 0, 0] < 39.5)
        speeds = np.hypot(*run.velocities[inside, 0, :2].T)
        assert speeds == pytest.approx(np.full(len(speeds), speeds.mean()), rel=0.02)


class TestDrawing:
    WOOD = Forest(10.0, 60.0, stems=800.0, dbh=0.3, dbh_sd=0.12, conifers=0.5)

    def drawn(self, number: int, width: float, start: float = 0.0, **changes: float) -> list:
        rng = np.random.default_rng(1)
        wood = replace(self.WOOD, **changes)
        return [forest.stems(rng, (wood,), start, width) for _ in range(number)]

    @pytest.mark.parametrize("width", [0.3, 1.0, 2.5])
    @pytest.mark.parametrize("start", [0.0, 35.0])
    def test_the_number_of_stems_is_that_of_a_poisson_process(
        self, width: float, start: float
    ) -> None:
        """n (w + d) L on average, with as much variance, evenly distributed from the start on."""
        tables = self.drawn(4000, width, start)
        counts = np.array([len(table) for table in tables])
        first = max(start, 10.0)
        expected = 0.08 * (width + 0.3) * (60.0 - first)
        assert counts.mean() == pytest.approx(expected, abs=4.0 * math.sqrt(expected / 4000))
        assert counts.var() == pytest.approx(expected, rel=0.1)
        x = np.concatenate([table[:, 0] for table in tables])
        assert first < x.min() and x.max() < 60.0
        assert x.mean() == pytest.approx(
            0.5 * (first + 60.0), abs=4.0 * (60.0 - first) / math.sqrt(12.0 * len(x))
        )
        assert all((np.diff(table[:, 0]) >= 0.0).all() for table in tables)

    @pytest.mark.parametrize("width", [0.1, 1.0])
    def test_thick_stems_are_struck_more_often(self, width: float) -> None:
        """The mean diameter weighted by w + d is (w m + m^2 + s^2) / (w + m)."""
        rng = np.random.default_rng(2)
        found = forest._diameters(rng, self.WOOD, width, 200_000)
        m, s = 0.3, 0.12
        assert found.mean() == pytest.approx((width * m + m * m + s * s) / (width + m), rel=5e-3)

    def test_the_energy_of_a_stem_of_40_cm(self) -> None:
        """38.7 * 40^2.31 = 194.3 kJ for silver fir."""
        both = forest.most_energy(np.array([0.4, 0.4]), np.array([True, False]))
        assert both == pytest.approx(np.array([0.93, 1.59]) * 194.3e3, rel=1e-3)

    def test_the_share_falls_from_the_axis_to_the_edge(self) -> None:
        found = forest.share(np.linspace(0.0, 1.0, 101))
        assert found[0] == pytest.approx(0.98, abs=1e-4) and found[-1] == 0.0
        assert found[58] == pytest.approx(-0.046 + 1.026 / 2)
        assert (np.diff(found) <= 0.0).all()

    def test_the_mean_energy_taken_per_metre(self) -> None:
        """n (w + d) times the energy of a stem times the mean share, over the width."""
        tables = self.drawn(4000, 1.0, dbh_sd=0.0, conifers=1.0)
        total = np.mean([table[:, 1].sum() for table in tables])
        mean_share = forest.share(np.linspace(0.0, 1.0, 20001)).mean()
        stem = 0.93 * 38.7 * 30.0**2.31
        assert total == pytest.approx(0.08 * 1.3 * 50.0 * stem * mean_share, rel=0.02)

    def test_two_forests_on_the_same_ground_add_up(self) -> None:
        rng = np.random.default_rng(3)
        half = replace(self.WOOD, stems=400.0)
        counts = [len(forest.stems(rng, (half, half), 0.0, 1.0)) for _ in range(4000)]
        expected = self.WOOD.struck(1.0) * 50.0
        assert np.mean(counts) == pytest.approx(expected, abs=4.0 * math.sqrt(expected / 4000))


TALUS = Site.load("talus")


def wooded(stems: float, **changes: float) -> Site:
    return replace(TALUS, forest=(Forest(12.0, 94.0, stems=stems, dbh=0.3, **changes),))


class TestSites:
    def test_without_stems_nothing_changes(self) -> None:
        bare, empty = (Batch(site, ()) for site in (TALUS, wooded(0.0)))
        for event in ("block, cliff", "group"):
            releases = [(seed, event) for seed in range(8)]
            assert bare.outcomes(releases) == empty.outcomes(releases)

    def test_lone_blocks_and_scenes_feel_the_same_stems(self) -> None:
        """`Batch` computes lone blocks without a scene; a run of the scene gives the same."""
        site = wooded(600.0, dbh_sd=0.1)
        releases = [(seed, "block, talus") for seed in range(25)]
        fast = Batch(site, ()).outcomes(releases)
        slow = [release(site, (), seed, event)[1] for seed, event in releases]
        assert fast == slow

    def test_groups_feel_stems_in_any_order_of_releases(self) -> None:
        site = wooded(600.0)
        releases = [(seed, "group") for seed in range(6)]
        forth, back = (Batch(site, ()).outcomes(releases[::step]) for step in (1, -1))
        assert forth == back[::-1]
        assert forth[3] == release_outcome(site, (), 3, "group")

    def test_many_stems_make_room(self) -> None:
        """A site whose first block strikes few stems and whose later blocks strike many."""
        site = wooded(6000.0)
        counts = [len(site.draw(seed, "large, cliff").stems[0]) for seed in range(8)]
        assert max(counts) > 64
        order = sorted(range(8), key=counts.__getitem__)
        forth = Batch(site, ()).outcomes([(seed, "large, cliff") for seed in order])
        back = Batch(site, ()).outcomes([(seed, "large, cliff") for seed in order[::-1]])
        assert forth == back[::-1]

    def test_the_same_seed_gives_the_same_stems_whatever_else_changes(self, tmp_path: Path) -> None:
        site = wooded(500.0, dbh_sd=0.1)
        site.save(tmp_path / "site.toml")
        again = Site.load(tmp_path / "site.toml")
        assert again == site
        one, again = site.draw(4, "group"), again.draw(4, "group")
        assert len(one.stems) == len(one.blocks)
        for first, second in zip(one.stems, again.stems, strict=True):
            assert first.tolist() == second.tolist()
        bare = TALUS.draw(4, "group")
        for block, other in zip(one.blocks, bare.blocks, strict=True):
            assert block.vertices.tolist() == other.vertices.tolist()
        other_seed = site.draw(5, "group")
        assert one.stems[0].tolist() != other_seed.stems[0].tolist()

    @pytest.mark.parametrize("event", ["block, talus", "block, cliff"])
    def test_denser_forest_lets_less_rock_pass(self, event: str) -> None:
        releases = [(seed, event) for seed in range(300)]
        reach = [
            np.mean([o.reached for o in Batch(site, ()).outcomes(releases)])
            for site in (TALUS, wooded(250.0), wooded(700.0), wooded(2000.0))
        ]
        assert reach[0] > reach[1] > reach[2] > reach[3]

    def test_the_number_of_stems_is_a_parameter(self) -> None:
        """`rigdda fit` and `rigdda sensitivity` change numbers of a site by their paths."""
        site = set_numbers(wooded(500.0, name="upper"), ["forest.upper.stems"], [300.0])
        assert site.forest == (replace(wooded(300.0).forest[0], name="upper"),)

    def test_two_forests_have_different_names(self) -> None:
        (wood,) = wooded(300.0).forest
        with pytest.raises(BadInput, match="give each a unique name"):
            replace(TALUS, forest=(wood, wood))
        assert len(replace(TALUS, forest=(wood, replace(wood, name="young"))).forest) == 2

    def test_the_lumped_mass_model_refuses_a_forest(self) -> None:
        with pytest.raises(BadInput, match="points do not strike stems"):
            lumped(wooded(300.0))


def test_stems_are_kept_with_a_scene_and_its_run(tmp_path: Path) -> None:
    scene = thrown([(5.0, 50e3, 40.0), (2.0, 1e3, 3.0)])
    assert scene.stems[0][:, 0].tolist() == [2.0, 5.0]
    again = scene_from_json(scene_to_json(scene))
    assert [table.tolist() for table in again.stems] == [table.tolist() for table in scene.stems]
    run = Simulation(scene).run(0.5)
    run.save(tmp_path / "run.npz")
    kept = Run.load(tmp_path / "run.npz").scene
    assert kept.stems[0].tolist() == scene.stems[0].tolist()


@pytest.mark.parametrize(
    ("stems", "field", "mend"),
    [
        ([[], []], "stems", "one for each of 1 blocks"),
        ([[(5.0, -1.0, 3.0)]], "stems[0]", "an energy and a height >= 0"),
        ([[(math.nan, 1.0, 3.0)]], "stems[0]", "a chainage from"),
        ([[(1e5, 1.0, 3.0)]], "stems[0]", "a chainage from"),
    ],
)
def test_stems_that_cannot_be_are_refused(stems: list, field: str, mend: str) -> None:
    with pytest.raises(BadInput) as caught:
        Scene(Terrain(FLAT), [box(0.0, 20.5)], rock(), stems=stems)
    assert caught.value.field == field and mend in str(caught.value)
