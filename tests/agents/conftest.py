"""A cheap site, `quick` without its mass, and a problem on it whose answer is known."""

from __future__ import annotations

import pytest
from valley import SITE, Valley, seen

from rigdda import Site
from rigdda.envs import DesignProblem


@pytest.fixture(scope="session")
def site() -> Site:
    return SITE


@pytest.fixture
def problem(site: Site) -> DesignProblem:
    return DesignProblem(site)


@pytest.fixture
def valley(site: Site, monkeypatch: pytest.MonkeyPatch) -> Valley:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    return Valley(site)
