"""Risk to the traffic below a site with a layout; the method is that of `rigdda.model.traffic`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rigdda.envs.intervals import Mean
from rigdda.model.traffic import Traffic


@dataclass(frozen=True, slots=True)
class Risk:
    """Expected consequences for the traffic on the section of a site, each with its 95 % interval.

    Parameters
    ----------
    hit, run_into : Mean
        Vehicles that falling rock hits, and vehicles that run into debris on the road [1/year].
    fatalities : Mean
        Fatalities [1/year].
    per_km : Mean
        Fatalities per km of road [1/year].
    individual : Mean
        Probability per year that a commuter is killed, see `rigdda.model.traffic.Traffic.person`.
    """

    hit: Mean
    run_into: Mean
    fatalities: Mean
    per_km: Mean
    individual: Mean

    @classmethod
    def of(cls, traffic: Traffic, toll: Sequence[Mean]) -> Risk:
        """Return the risk on a section.

        Parameters
        ----------
        traffic : Traffic
            The traffic.
        toll : three Mean
            Vehicles hit, vehicles that run into debris and fatalities per metre of road and year.
        """
        hit, run_into, fatalities = (mean.times(traffic.section_length) for mean in toll)
        individual = fatalities.times(traffic.person)
        return cls(hit, run_into, fatalities, toll[2].times(1000.0), individual)
