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
def valley(site: Site, monkeypatch: pytest.MonkeyPatch) -> Valley:
    monkeypatch.setattr("rigdda.agents.designers.catalogue.ensemble", seen)
    monkeypatch.setattr(design_envelope, "of", partial(design_envelope.of, blocks=60))
    return Valley(site)
