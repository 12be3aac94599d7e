"""A cheap site, `quick` without its mass, and a problem on it whose answer is known."""

from __future__ import annotations

from functools import partial

import pytest
from valley import SITE, Valley, seen

from rigdda import Site
from rigdda.envs import DesignProblem, design_envelope


@pytest.fixture(scope="session")
def site() -> Site:
    return SITE


@pytest.fixture
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site)


@pytest.fixture
def few_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Release few blocks for design envelopes."""
    monkeypatch.setattr(design_envelope, "of", partial(design_envelope.of, blocks=60))


@pytest.fixture
def valley(site: Site, few_blocks: None, monkeypatch: pytest.MonkeyPatch) -> Valley:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    return Valley(site)
