"""Designs whose barriers must meet their checks, and the first line of a design."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace

from rigdda import BadInput, Ditch, Fence, Layout, Site
from rigdda.agents import designers
from rigdda.agents.designers.menu import Menu
from rigdda.agents.designers.protocol import Ledger
from rigdda.agents.designers.store import Store
from rigdda.app.barrier_checks import check_layout
from rigdda.app.design import _searched
from rigdda.app.reports import findings
from rigdda.app.reports.findings import DesignAnswer, FailedCheck, headline
from rigdda.barriers import Removal
from rigdda.envs import DesignProblem, design_envelope
from rigdda.envs.barrier_formulas import checks_of
from rigdda.envs.environments import BarrierDesign
from rigdda.envs.fence_checks import demand_at
from rigdda.model.existing import Existing

pytestmark = pytest.mark.usefixtures("few_blocks")


@pytest.fixture
def required() -> DesignProblem:
    return DesignProblem("verge", checks="required")


def test_a_barrier_that_fails_a_check_is_not_feasible(required: DesignProblem) -> None:
    weak, free = (Fence(7.0, 1.5, energy_class=100),), required.with_checks("reported")
    assert free.fits(weak) and not required.fits(weak)
    with pytest.raises(BadInput, match="satisfy the check of energy"):
        required.check(weak)
    failed = [check.check for check in check_layout(free, weak).failed]
    assert failed[0] == "energy"
    assert required.fits(()) and required != free and hash(required) != hash(free)


def test_all_that_may_be_built_meets_its_checks() -> None:
    required = DesignProblem("quick", checks="required")
    site, menu = required.site, Menu(required)
    envelope = design_envelope.of(site, required.zone)
    for kind in ("fence", "ditch", "embankment", "gravity_wall"):
        free = Menu(required.with_checks("reported")).singles(kind)
        sound = [
            b
            for b in free
            if all(c.satisfied for c in checks_of(site, b, demand_at(envelope, site.rule, b.x)))
        ]
        assert menu.singles(kind) == sound
        assert kind != "fence" or 0 < len(sound) < len(free)


def test_the_demand_is_that_without_existing_barriers_that_a_layout_removes() -> None:
    strong = Existing("fence", 21.0, 6.0, energy_class=5000, removable=True, removal=40.0)
    site = replace(Site.load("old-fence"), existing=(strong,))
    problem = DesignProblem(site, checks="required")
    below = Fence(24.0, 2.0, energy_class=100)
    replacing = Fence(21.0, 2.0, energy_class=100)
    assert not problem.fits((Removal(21.0), below)) and not problem.fits((replacing,))
    for layout in ((Removal(21.0), below), (replacing,), (below,)):
        free = problem.with_checks("reported")
        failed = [c for c in check_layout(free, layout).failed if not c.existing]
        assert problem.fits(layout) == (not failed)


def test_any_action_of_the_environment_builds_what_meets_its_checks() -> None:
    env = BarrierDesign("verge", releases=1, checks="required")
    problem, rng = env.problem, np.random.default_rng(0)
    built = 0
    for _ in range(20):
        layout = problem.decode(rng.uniform(-1.0, 1.0, problem.size))
        built += len(layout)
        for barrier in layout:
            single = check_layout(problem.with_checks("reported"), (barrier,))
            assert single.satisfied, single.failed
    assert built > 0
    env.close()


def test_checks_are_either_required_or_reported() -> None:
    with pytest.raises(BadInput, match="checks"):
        DesignProblem("verge", checks="no")


def test_existing_barriers_are_checked() -> None:
    site = Site.load("verge")
    old = (
        Existing("gravity_wall", 7.0, height=1.0, thickness=0.3),
        Existing("fence", 5.2, height=2.0, energy_class=500, condition=0.5),
    )
    stands = DesignProblem(replace(site, existing=old))
    checks = check_layout(stands, ())
    assert {check.barrier.split()[0] for check in checks.table} == {"existing"}
    wall = {c.check: c for c in checks.table if "wall" in c.barrier}
    assert wall["sliding, impact"].use > 1.0
    energy = next(c for c in checks.table if c.check == "energy")
    new = DesignProblem(replace(site, existing=(replace(old[1], condition=1.0),)))
    full = next(c for c in check_layout(new, ()).table if c.check == "energy")
    assert full.capacity == 500.0 and energy.capacity == 250.0
    assert full.demand == pytest.approx(energy.demand)


def test_an_existing_barrier_outside_the_zone_is_checked() -> None:
    site = replace(
        Site.load("verge"), existing=(Existing("fence", 5.0, height=1.0, energy_class=100),)
    )
    stands = DesignProblem(site, zone=(7.0, site.barrier_zone.end))
    assert [c.check for c in check_layout(stands, ()).failed][:2] == ["energy", "height"]


USUAL = DesignAnswer(
    layout="ditch at x = 9",
    bare="without barriers",
    z=(80.0, 70.0, 90.0),
    nothing=(100.0, 95.0, 105.0),
    targets=None,
    asked="rock arrives with a probability of at most 5 %",
    required=True,
    failed=(),
    reaching=("", 0.0),
)


def answer(**values: object) -> DesignAnswer:
    return USUAL._replace(**values)


ENERGY = FailedCheck("fence 1,000 kJ, at 9.0 m", "energy", 1.26)
HEIGHT = FailedCheck("fence 1,000 kJ, at 9.0 m", "height", 4.0)
DEAR = (130.0, 120.0, 140.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "Build: ditch at x = 9."),
        ({"targets": "met"}, "Build: ditch at x = 9."),
        ({"layout": ""}, "Build nothing: no layout was found that meets every check and is worth "),
        ({"layout": "", "required": False}, "Build nothing: no layout was found that is worth"),
        ({"layout": "", "targets": "met"}, "Build nothing: the slope without barriers meets"),
        ({"layout": "", "targets": "undecided"}, "Verify with more releases: no layout was shown"),
        ({"layout": "", "targets": "missed"}, "No layout that was found meets the target that"),
        ({"targets": "missed"}, "No layout that was found meets the target that rock arrives"),
        ({"targets": "missed", "failed": (ENERGY,)}, "No layout that was found meets the target"),
        ({"failed": (ENERGY, HEIGHT)}, "Do not build this as it is: ditch at x = 9. It fails its "),
        ({"targets": "undecided"}, "Verify with more releases before you build"),
        ({"z": DEAR}, "Build nothing: the layout that was found costs 30 EUR"),
        ({"z": DEAR, "targets": "met"}, "Build, for the target alone: ditch at x = 9."),
        ({"z": DEAR, "targets": "met", "verified": False}, "Verify with a new design before you "),
        ({"z": DEAR, "verified": False}, "Build nothing: the layout that was found costs 30 EUR"),
        ({"z": (99.0, 90.0, 110.0)}, "Verify with more releases before you build"),
    ],
)  # fmt: skip
def test_the_first_line_of_a_design(values: dict, words: str) -> None:
    line = headline(answer(**values))
    assert line.startswith(words), line
    if "failed" in values and ENERGY in values["failed"]:
        both = " and height 4.00" if HEIGHT in values["failed"] else ""
        assert f"fence 1,000 kJ, at 9.0 m: energy 1.26{both} times the limit" in line


def test_the_first_line_says_how_often_rock_still_arrives() -> None:
    line = headline(answer(reaching=("large", 0.46)))
    assert (
        line
        == "Build: ditch at x = 9. Rock of 'large' still reaches the road in 46 % of the releases."
    )
    assert headline(answer(reaching=("large", 0.01))) == "Build: ditch at x = 9."


def test_ditches_are_compared_with_the_chart_where_no_block_passes(required: DesignProblem) -> None:
    shallow = Ditch(7.0, 1.0, 0.5)
    assert {c.check for c in checks_of(required.site, shallow, None)} == {"width", "depth"}
    assert not required.fits((shallow,))


def test_an_existing_barrier_that_fails_does_not_disqualify_a_layout() -> None:
    """The worn fence stands with every layout and without any."""
    site = replace(
        Site.load("verge"),
        existing=(Existing("fence", 5.2, height=1.0, energy_class=100, condition=0.3),),
    )
    checks = check_layout(DesignProblem(site), ())
    assert checks.failed and all(check.existing for check in checks.failed)
    assert checks.satisfied and findings.failed_checks(checks) == []
    new = (Fence(8.0, 1.0, energy_class=100),)
    both = check_layout(DesignProblem(site), new)
    assert not both.satisfied
    assert {check.barrier for check in both.failed if not check.existing} == {new[0].label}
    assert len(findings.failed_checks(both)) < len(both.failed)


COSTLY = Fence(5.2, 4.0, energy_class=3000)
CHEAP = Fence(7.0, 1.5, energy_class=100)
"""Both may stand on `verge`; the second fails its checks and costs less than it saves."""


@pytest.mark.parametrize(
    ("free", "kept"), [((COSTLY,), None), ((), None), ((CHEAP,), (CHEAP,))], ids=repr
)
def test_a_search_without_required_checks_counts_only_if_it_finds_a_better_layout(
    free: Layout,
    kept: Layout | None,
    required: DesignProblem,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    def design(problem, simulations, seed, progress, store):
        ledger = Ledger(problem, simulations, seed, progress, store)
        layout = () if problem.checks == "required" else free
        return ledger.result(ledger.evaluate(layout, "report", 20), "start")

    monkeypatch.setattr(designers, "module", lambda name: SimpleNamespace(design=design))
    interim = SimpleNamespace(consider=lambda entry: None)
    store = Store(tmp_path / "evaluations.jsonl", outcomes=True)
    entries: list = []
    found, unchecked = _searched(required, "one", 40, 0, entries.append, store, 0.0, interim)
    assert found.layout == ()
    assert (None if unchecked is None else unchecked.layout) == kept
    assert found.simulations == 40
