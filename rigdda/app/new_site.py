"""Creation of a site file from a surveyed profile, with a comment on every field."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import tomli_w
from numpy.typing import NDArray

from rigdda import BadInput, Site
from rigdda.app.value_origins import CHECK_DEFAULT, GIVEN, PLACEHOLDER, SURVEYED
from rigdda.fields import described
from rigdda.files import LONGEST_NAME, atomic
from rigdda.geometry import polygon_properties
from rigdda.ground.barrier_zone import BarrierZone
from rigdda.ground.grounds import GROUNDS, USUAL
from rigdda.ground.prices import DITCHES, Consequences, Prices
from rigdda.ground.surface import Surface
from rigdda.ground.terrain import Terrain
from rigdda.model import loose_blocks
from rigdda.model.block import convex_polygon
from rigdda.model.existing import Existing
from rigdda.model.forest import Forest
from rigdda.model.partial_factors import PartialFactors
from rigdda.model.site_tables import (
    Event,
    Motion,
    Origin,
    Road,
    SiteTables,
    Slope,
)
from rigdda.model.soundness import LEAST_BEYOND
from rigdda.model.source import Source
from rigdda.model.survey import Profile, profile_of, read_survey
from rigdda.model.traffic import Traffic
from rigdda.rounding import chainage, rounded

Floats = NDArray[np.float64]
Span = tuple[float, float]

SLOPE_DEG, FACE_DEG = 25.0, 40.0
"""Inclination of the ground above which it is slope rather than its foot, and a face [deg]."""

VERGE_WIDTH, LANES_WIDTH = 2.0, 7.0
"""Distance of a road from the toe, and its width, where it is not given [m]."""

UPHILL = 15.0
"""Length of the barrier zone uphill of the toe, where it is not given [m]."""

ZONE_CLEARANCE = 0.5
"""Distance of the barrier zone from the road, and from loose rock, where it is not given [m]."""

SHORTEST = 0.5
"""Length of the shortest placeholder of a band of loose rock [m]."""

VOLUME = (0.1, 1.0)
"""Placeholder of the volume of blocks [m3]."""

PERIOD, MASS_PERIOD = 5.0, 50.0
"""Placeholders of the return period of blocks and of a jointed mass [years on 100 m of slope]."""

JOINTS = ((70.0, 1.0), (-20.0, 1.0))
"""Placeholders of the dip [deg] and the spacing [m] of the joints of a mass."""

PLACEHOLDER_TRAFFIC = (2000.0, 60.0, 100.0)
"""Placeholders of the vehicles per day, their speed [km/h] and the length of the road [m]."""

BEDROCK = ("hard_rock", "weathered_rock", "asphalt")
"""Grounds that cost as much to excavate as rock."""

FOREST = (400.0, 0.3, 0.1)
"""Placeholders of the stems on a hectare, their diameter and its standard deviation [m]."""

PLACEHOLDER_FENCE, PLACEHOLDER_FENCE_ROOM, PLACEHOLDER_REMOVAL = (250, 2.0), 3.0, 100.0
"""Placeholders of a fence that stands already: class [kJ] and height [m], distance from the lower
end of the zone [m], which leaves room for its elongation, and cost of its removal [EUR/m]."""

TEMPLATE = '# To use this table, remove the first "# " of each of its lines.'
"""First line of a template."""

BLOCK = 0.8
"""Edge of the placeholder of a block on ground that overhangs [m]."""

BLOCK_GAP = 0.01
"""Height of this block above the ground [m], so that rounding does not move it into the ground."""

CORNER_DIGITS = 9
"""Decimals of the corners of a mass between points of the survey [m]. With fewer, a corner on a
straight face could make the mass concave."""

PROFILE_SPEED = 3.0
"""Mean speed along the whole profile for which the simulated time is enough [m/s]."""

MASS_OPTION = re.compile(r"(.+):\s*([+-]?[\d.]+)")
"""NAME:START-END:DIP of an option."""

RANGE = re.compile(r"(.+?):\s*([+-]?[\d.]+)\s*(?:-|to|\.\.)\s*([+-]?[\d.]+)")
"""NAME:START-END of an option."""


class SiteRequest(NamedTuple):
    """Requested properties of a new site, in chainages of the survey [m]."""

    road: Span | None = None
    toe: float | None = None
    zone: Span | None = None
    grounds: Sequence[str] = ()
    """NAME:START-END, or NAME for all other ground."""
    sources: Sequence[str] = ()
    """NAME:START-END."""
    masses: Sequence[str] = ()
    """NAME:START-END:DIP."""
    layer: str | None = None


class Mass(NamedTuple):
    """A jointed mass, in chainages of the site.

    It lies between a vertical crack at the upper end of its stretch of the ground and a plane that
    dips downhill and ends at the lower end, as in the analysis of plane failure by Hoek and Bray.
    """

    name: str
    span: Span
    """Stretch of the surveyed ground that is its face [m]."""
    foot: float
    """Elevation of the foot of the crack [m]."""
    polygon: list[list[float]]
    """Its corners [m]."""


def compose(name: str, file: Path, request: SiteRequest) -> tuple[str, Profile]:
    """Return the text of a site file for a surveyed profile, and the profile.

    Parameters
    ----------
    name : str
        Name of the site.
    file : Path
        The survey, a CSV file or a DXF drawing.
    request : SiteRequest
        What is known in addition to the profile; all other values are placeholders.

    Raises
    ------
    BadInput
        If the survey or the request is unsound, or no site can be made of them.
    """
    road = None if request.road is None else _sorted("--road", request.road)
    profile = profile_of(str(file), read_survey(file, request.layer), road)
    draft = _Draft(profile, request._replace(road=road))
    text = _render(_head(name, file, profile), draft.tables(name, file))
    Site.parse(text, name)
    return text, profile


NEAR = 0.01
"""Distance beyond the end of the profile within which a stretch of ground counts as ending at it
[m]; chainages are often rounded."""


def file_of(name: str, out: Path | None) -> Path:
    """Return the file to write, by default the name of the site with the ending .toml.

    Raises
    ------
    BadInput
        If the name cannot be that of a file, or the file has another ending.
    """
    if out is None:
        if len(os.fsencode(name)) > LONGEST_NAME:
            hint = f"use a name of at most {LONGEST_NAME} bytes, or give the file with --out"
            raise BadInput("NAME", name, hint)
        if not re.fullmatch(r"[\w][\w .()-]*", name):
            raise BadInput("NAME", name, "use letters, digits, spaces, - and _, or give --out")
        return Path(f"{name}.toml")
    if out.suffix != ".toml":
        raise BadInput("--out", str(out), "name a file that ends in .toml")
    return out


def write(path: Path, text: str) -> None:
    """Write a new site file.

    Raises
    ------
    BadInput
        If there is a file of that name, which may have been edited, or it cannot be written.
    """
    if os.path.exists(path):
        hint = "name another file, or remove this one: it may have been edited and is not replaced"
        raise BadInput("--out", str(path), hint)
    try:
        with atomic(path) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        hint = f"name a file that can be written ({error.strerror})"
        raise BadInput("--out", str(path), hint) from None


def _sorted(option: str, span: Span) -> Span:
    """Return two chainages, the lesser first."""
    low, high = sorted(span)
    if not low < high:
        raise BadInput(option, list(span), "give two different chainages")
    return low, high


class Part(NamedTuple):
    """A table of the file."""

    head: str
    """Its header with brackets, empty for the top of the file."""
    table: type[msgspec.Struct]
    """The class that reads it."""
    values: Mapping[str, tuple[Any, str]]
    """The value of each field that is written, and its origin."""
    comments: Sequence[str] = ()
    """Lines after the fields."""
    template: bool = False
    """Whether all of it is written as a comment, because the site is complete without it."""


class _Draft:
    """The tables of a new site, in its own chainages."""

    def __init__(self, profile: Profile, request: SiteRequest):
        self.profile, self.request = profile, request
        self.x, self.y = profile.points.T
        self.overhangs = bool((np.diff(self.x) < 0.0).any())
        self.asked = self._asked()
        self.road = self._road()
        self.toe = self._toe(self.road[0])
        self.masses = [self._mass(text) for text in request.masses]
        for one, other in pairwise(sorted(self.masses, key=lambda mass: mass.span)):
            if other.span[0] < one.span[1]:
                hint = f"let it begin where {one.name} ends"
                raise BadInput("--mass", other.name, hint)
        self.sources = self._sources()
        self.zone = self._zone()
        self.named: set[str] = set()
        self.base, self.stretches, self.surfaces = self._grounds()

    def tables(self, name: str, file: Path) -> list[Part]:
        """Return all tables of the file."""
        given = self.request
        road = GIVEN if given.road else PLACEHOLDER
        zone = GIVEN if given.zone else PLACEHOLDER
        words = f"Imported from {file.name}. Say here what is known of the slope, and by whom."
        ground = f"{GIVEN} where named by --ground, else {PLACEHOLDER}"
        ground = ground if given.grounds else PLACEHOLDER
        slope = {
            "points": (_pairs(self._bedrock()), self._surveyed()),
            "toe": (self.toe, PLACEHOLDER if given.toe is None else GIVEN),
            "surface": (self.base, GIVEN if self.base in self.named else PLACEHOLDER),
            "surfaces": (self.stretches, ground),
        }
        origin = msgspec.to_builtins(self.profile.origin)
        edges = dict(zip(("start", "end"), ((at, road) for at in self.road), strict=True))
        ends = dict(zip(("start", "end"), ((at, zone) for at in self.zone), strict=True))
        limits = {
            field.name: (field.default, CHECK_DEFAULT)
            for field in described(BarrierZone)
            if not field.needed
        }
        return [
            Part("", SiteTables, {"name": (name, GIVEN), "description": (words, PLACEHOLDER)}),
            Part("[slope]", Slope, slope),
            Part(
                "[origin]",
                Origin,
                {key: (value, SURVEYED) for key, value in origin.items() if value is not None},
            ),
            *self._rock(),
            Part("[road]", Road, edges),
            Part("[barrier_zone]", BarrierZone, ends | limits),
            *map(self._surface, self.surfaces),
            self._prices(),
            _defaults("[consequences]", Consequences),
            _defaults("[rule]", PartialFactors),
            Part(
                "[motion]",
                Motion,
                {
                    "duration": (self._duration(), CHECK_DEFAULT),
                    "dt": (Motion().dt, CHECK_DEFAULT),
                },
            ),
            _traffic(),
            self._forest(),
            self._existing(),
        ]

    def _inclinations(self) -> Floats:
        """Return how steeply each segment of the ground falls [deg]."""
        return np.degrees(np.arctan2(-np.diff(self.y), np.abs(np.diff(self.x))))

    def _toe(self, most: float) -> float:
        """Return the foot of the slope, not beyond a chainage."""
        if self.request.toe is not None:
            at, origin = self.profile.origin.x_of(self.request.toe), self.profile.origin
            if not self.x[0] <= at <= most:
                ends = sorted(map(origin.chainage_of, (float(self.x[0]), most)))
                hint = f"give a chainage on the slope, {ends[0]:.10g} to {ends[1]:.10g}"
                raise BadInput("--toe", self.request.toe, hint)
            return round(at, 3)
        steep = (self._inclinations() >= SLOPE_DEG) & (self.x[:-1] < most)
        if not steep.any():
            return round(float(max(self.x[0], min(most, self.x[-1]))), 3)
        return round(float(min(self.x[1:][steep][-1], most)), 3)

    def _asked(self) -> Span | None:
        """Return the requested barrier zone, which must lie between the crest and the road."""
        if self.request.zone is None:
            return None
        origin, road = self.profile.origin, self.request.road
        low, high = sorted(map(origin.x_of, _sorted("--zone", self.request.zone)))
        ends = float(self.x[0]), float(self.x[-1])
        edge = "the end of the ground"
        if road is not None:
            ends, edge = (ends[0], min(map(origin.x_of, road))), "the uphill edge of the road"
        if not ends[0] <= low < high <= ends[1]:
            first, last = map(origin.chainage_of, ends)
            hint = f"let it lie between the crest at {first:.10g} and {edge} at {last:.10g}"
            raise BadInput("--zone", list(self.request.zone), hint)
        return round(low, 3), round(high, 3)

    def _road(self) -> Span:
        """Return the edges of the road, and check that the ground continues beyond it.

        If the barrier zone is given but the road is not, the road lies below the zone.
        """
        origin, end = self.profile.origin, float(self.x[-1])
        if self.request.road is not None:
            low, high = sorted(map(origin.x_of, self.request.road))
        else:
            low = max(self._toe(end) + VERGE_WIDTH, self.asked[1] if self.asked else -np.inf)
            high = low + LANES_WIDTH
        need = high + LEAST_BEYOND
        if end < need:
            run, drop = self.x[-1] - self.x[-2], self.y[-2] - self.y[-1]
            level = float(self.y[-1] - (need - end) * (drop / run if run > 0.0 else 0.0))
            at = f"{origin.chainage_of(need):.10g}, {level + origin.elevation:.6g}"
            whose = "the road" if self.request.road else "the placeholder of the road (see --road)"
            hint = (
                f"survey the ground to {LEAST_BEYOND:g} m beyond {whose}, or add the point {at} if "
                "it continues like its last segment"
            )
            raise BadInput("--profile", f"ends at chainage {origin.chainage_of(end):.10g}", hint)
        return round(low, 3), round(high, 3)

    def _sources(self) -> list[tuple[str, Span, str]]:
        """Return the name of each source, its band and the origin of the band."""
        found, origin, reach = [], self.profile.origin, _reach()
        for text in self.request.sources:
            name, span = _ranged("--source", text, origin)
            if span is None:
                hint = 'give NAME:START-END with chainages, such as "cliff:2-8"'
                raise BadInput("--source", text, hint)
            if not self.x[0] <= span[0] < span[1] < self.road[0]:
                low, high = sorted(map(origin.chainage_of, (float(self.x[0]), self.road[0])))
                hint = f"put it uphill of the road, between chainage {low:.10g} and {high:.10g}"
                raise BadInput("--source", text, hint)
            first, last = float(self.x[0]) + reach, self.road[0] - reach
            if first < last and not first <= span[0] < span[1] < last:
                low, high = sorted(map(origin.chainage_of, (first, last)))
                low, high = math.ceil(100.0 * low) / 100.0, math.floor(100.0 * high) / 100.0
                hint = f"keep it between chainage {low:.10g} and {high:.10g}, so that its blocks "
                hint += "lie on the profile and clear the road"
                raise BadInput("--source", text, hint)
            found.append((name, span, GIVEN))
        return found if found or self.masses else [("face", self._face(), PLACEHOLDER)]

    def _mass(self, text: str) -> Mass:
        """Return the mass that an option names."""
        origin = self.profile.origin
        name, (low, high), dip = _mass_option(text, origin)
        if not self.x[0] <= low < high < self.road[0]:
            ends = sorted(map(origin.chainage_of, (float(self.x[0]), self.road[0])))
            hint = f"put it uphill of the road, between chainage {ends[0]:.10g} and {ends[1]:.10g}"
            raise BadInput("--mass", text, hint)
        if self.overhangs:
            raise BadInput("--mass", text, "the profile overhangs: give the polygon in the file")
        points = _with_corners(self.profile.points, (low, high))
        face = points[_crack(points, low)[1] : _lower_end(points, high) + 1]
        top, bottom = float(face[0, 1]), float(face[-1, 1])
        if not bottom < top:
            above, below = top + origin.elevation, bottom + origin.elevation
            hint = (
                "name a stretch on which the ground falls: it is at "
                f"{above:.6g} m at the upper end and at {below:.6g} m at the lower end"
            )
            raise BadInput("--mass", text, hint)
        rise = (high - low) * math.tan(math.radians(dip))
        foot = max(round(bottom + rise, 3), bottom)
        if not 0.0 <= dip < 90.0 or not foot < top:
            fall = math.degrees(math.atan2(top - bottom, high - low))
            most = rounded(fall, ".3g", "down")
            hint = f"give a plane that dips by 0 to less than the {most} deg of the face"
            raise BadInput("--mass", text, hint)
        polygon = [*_pairs(face), [low, foot]]
        try:
            convex_polygon("--mass", polygon)
        except BadInput:
            hint = "its face is hollow: name a part of it, or give the polygon in the file"
            raise BadInput("--mass", text, hint) from None
        return Mass(name, (low, high), foot, polygon)

    def _bedrock(self) -> Floats:
        """Return the ground without the jointed masses, (n, 2)."""
        masses = sorted(self.masses, key=lambda mass: mass.span)
        points = _with_corners(self.profile.points, [at for mass in masses for at in mass.span])
        for mass in masses:  # downhill, so that the ground at the lower end is still as surveyed
            low, high = mass.span
            above, below = points[: _crack(points, low)[0] + 1], points[_lower_end(points, high) :]
            crack = [] if above[-1, 1] == mass.foot else [[low, mass.foot]]
            points = np.array([*above.tolist(), *crack, *below.tolist()])
        return points

    def _surveyed(self) -> str:
        """Return the note on the origin of the points of the ground."""
        names = ", ".join(mass.name for mass in self.masses)
        return f"{SURVEYED}, without the rock of {names}" if names else SURVEYED

    def _face(self) -> Span:
        """Return the upper third of the face, where blocks of the placeholder are on the ground.

        Where it can, it keeps clear of a zone for barriers that is given: barriers may not stand in
        a band of loose rock, and a placeholder must not make the zone smaller.
        """
        reach = _reach()
        angle = np.where(self.x[:-1] < self.toe, self._inclinations(), -90.0)
        steep = np.flatnonzero(angle >= min(FACE_DEG, angle.max()))
        low = max(float(self.x[:-1][steep].min()), float(self.x[0]) + reach)
        high = low + max((self.toe - low) / 3.0, SHORTEST)
        most = self.road[0] - 2.0 * reach
        if not low < most:
            hint = "say where loose rock lies with --source NAME:START-END, clear of the road"
            raise BadInput("--source", None, hint)
        high = min(high, most)
        if self.asked is not None:
            clear = reach + ZONE_CLEARANCE
            above, below = (low, self.asked[0] - clear), (self.asked[1] + clear, high)
            spans = ((max(a, low), min(b, high)) for a, b in (above, below))
            low, high = next((span for span in spans if span[1] - span[0] >= SHORTEST), (low, high))
        return round(low, 3), round(high, 3)

    def _rock(self) -> list[Part]:
        """Return the tables of sources and events."""
        sources, events = [], []
        for name, span, sure in self.sources:
            blocks = self.overhangs and not self.request.sources
            block = _block(self.profile.points, span) if blocks else []
            place: dict[str, tuple[Any, str]] = {"blocks": ([block], sure)} if blocks else {}
            usual = Source(band=(1.0, 2.0))
            values: dict[str, tuple[Any, str]] = {
                "name": (name, sure),
                **(place or {"band": (list(span), sure)}),
                "density": (usual.density, CHECK_DEFAULT),
                "surface": (usual.surface, CHECK_DEFAULT),
            }
            if not place:
                for key in ("corners", "aspect", "spin", "speed"):
                    value = getattr(usual, key)
                    values[key] = (
                        list(value) if isinstance(value, tuple) else value,
                        CHECK_DEFAULT,
                    )
            sources.append(Part("[[sources]]", Source, values))
            size: dict[str, tuple[Any, str]] = {"volume": (list(VOLUME), PLACEHOLDER)}
            if place:  # a block as wide as the root of its area, not a strip of rock
                area = abs(polygon_properties(np.array(block))[0])
                size = {"width": (round(math.sqrt(area), 2), PLACEHOLDER)}
            law = (
                {}
                if place
                else {"exponent": (0.6, CHECK_DEFAULT), "number": ([1, 1], CHECK_DEFAULT)}
            )
            often = {
                "name": (f"block, {name}", PLACEHOLDER),
                "source": (name, sure),
                "return_period": (PERIOD, PLACEHOLDER),
                "section_length": (100.0, PLACEHOLDER),
                **size,
                **law,
                "design": (True, PLACEHOLDER),
            }
            events.append(Part("[[events]]", Event, often))
        for mass in self.masses:
            source, event = _mass_tables(mass)
            sources.append(source)
            events.append(event)
        if not self.masses:
            sources.append(sources.pop()._replace(comments=JOINTED))
        return [*sources, *events]

    def _zone(self) -> Span:
        """Return where barriers may stand."""
        if self.asked is not None:
            return self.asked
        high = self.road[0] - ZONE_CLEARANCE
        free = [span[1] + _reach() + ZONE_CLEARANCE for _, span, _ in self.sources]
        free += [mass.span[1] + ZONE_CLEARANCE for mass in self.masses]
        low = max(self.toe - UPHILL, *free, float(self.x[0]))
        if not low < high:
            hint = (
                f"give the zone for barriers: loose rock reaches x = {chainage(low)}, close to "
                "the road"
            )
            raise BadInput("--zone", None, hint)
        return round(low, 3), round(high, 3)

    def _existing(self) -> Part:
        """Return the template of a barrier that stands already, at the lower end of the zone."""
        reach, start, free = _reach(), float(self.x[0]), []
        for low, high in sorted(span for _, span, _ in self.sources):
            free.append((start, low - reach))
            start = max(start, high + reach)
        free.append((start, self.zone[1]))
        clear = [(a, min(b, self.zone[1])) for a, b in free]
        low, high = ([(a, b) for a, b in clear if b - a > ZONE_CLEARANCE] or [self.zone])[-1]
        low = max(low, min(self.zone[0], high - ZONE_CLEARANCE))
        at = round(max(high - PLACEHOLDER_FENCE_ROOM, 0.5 * (low + high)), 3)
        values = {
            "kind": ("fence", PLACEHOLDER),
            "x": (at, PLACEHOLDER),
            "height": (PLACEHOLDER_FENCE[1], PLACEHOLDER),
            "energy_class": (PLACEHOLDER_FENCE[0], PLACEHOLDER),
            "condition": (Existing("fence", 0.0).condition, CHECK_DEFAULT),
            "removable": (True, PLACEHOLDER),
            "removal": (PLACEHOLDER_REMOVAL, PLACEHOLDER),
        }
        return Part("[[existing]]", Existing, values, template=True)

    def _forest(self) -> Part:
        """Return the template of a forest above the barrier zone, or on it if there is no room."""
        start = float(self.x[0])
        ends = (start, self.zone[0]) if self.zone[0] > start else self.zone
        edges = dict(zip(("start", "end"), ((at, PLACEHOLDER) for at in ends), strict=True))
        usual = Forest(*ends, *FOREST)
        values = {name: (getattr(usual, name), PLACEHOLDER) for name in ("stems", "dbh", "dbh_sd")}
        kept = {name: (getattr(usual, name), CHECK_DEFAULT) for name in ("conifers", "height")}
        return Part("[[forest]]", Forest, edges | values | kept, template=True)

    def _grounds(self) -> tuple[str, list[dict[str, Any]], dict[str, str]]:
        """Return the surface outside the stretches, the stretches, and the grounds."""
        base, given = None, []
        grounds = {"rock": USUAL["rock"], "soil": USUAL["soil"]}
        for text in self.request.grounds:
            word, span = _ranged("--ground", text, self.profile.origin)
            surface, ground = _library(word)
            if span is not None:
                self._check_on_profile(text, span)
                given.append((span, surface))
            elif base is None:
                base = surface
            else:
                hint = f"give it a range, such as {word}:12-30: {base} is that of all other ground"
                raise BadInput("--ground", text, hint)
            grounds[surface] = ground
            self.named.add(surface)
        _check_apart(given, self.profile.origin)
        grounds["asphalt"] = USUAL["asphalt"]
        grounds["concrete"] = USUAL["concrete"]  # of walls and fences
        ends = [at for span, _ in given for at in span]
        low, high = float(self.x[0]), float(self.x[-1])
        cuts = sorted({low, high, self.toe, *self.road, *ends})
        names: list[tuple[Span, str]] = []
        for start, end in pairwise(at for at in cuts if low <= at <= high):
            middle = 0.5 * (start + end)
            usual = base or ("rock" if middle < self.toe else "soil")
            if self.road[0] < middle < self.road[1]:
                usual = "asphalt"
            own = (surface for (a, b), surface in given if a < middle < b)
            surface = next(own, usual)
            if names and names[-1][1] == surface:
                (start, _), _ = names.pop()
            names.append(((start, end), surface))
        main = base or "rock"
        stretches = [
            {"start": start, "end": end, "surface": surface}
            for (start, end), surface in names
            if surface != main
        ]
        return main, stretches, grounds

    def _check_on_profile(self, text: str, span: Span) -> None:
        """Check that a stretch of ground lies on the profile."""
        ends = float(self.x[0]), float(self.x[-1])
        if not ends[0] - NEAR <= span[0] < span[1] <= ends[1] + NEAR:
            first, last = sorted(map(self.profile.origin.chainage_of, ends))
            hint = f"put it on the profile, chainage {first:.10g} to {last:.10g} of the survey"
            raise BadInput("--ground", text, hint)

    def _surface(self, name: str) -> Part:
        """Return the table of a surface: its ground, and what the library has for it."""
        ground = GROUNDS[self.surfaces[name]]
        spans = {
            "friction_deg": ground.friction_deg,
            "restitution": ground.restitution,
            "rolling": ground.rolling,
            "roughness": ground.roughness,
        }
        lines = [
            f"{key} = {span.typical:g}  # plausible {span.low:g} to {span.high:g}: {span.source}"
            for key, span in spans.items()
        ]
        sure = GIVEN if name in self.named else PLACEHOLDER
        sure = CHECK_DEFAULT if name == "concrete" and sure != GIVEN else sure
        return Part(
            f"[surfaces.{_key(name)}]",
            Surface,
            {"ground": (self.surfaces[name], sure)},
            (f"{ground.words}; give what you know better in place of these values:", *lines),
        )

    def _prices(self) -> Part:
        """Return the default prices, with a price of excavation for each surface of the ground."""
        prices = _defaults("[prices]", Prices)
        used = dict.fromkeys((self.base, *(part["surface"] for part in self.stretches)))
        digging = dict(DITCHES)
        for name in used:
            rock = self.surfaces[name] in BEDROCK
            digging.setdefault(name, DITCHES["rock" if rock else "soil"])
        return prices._replace(values={**prices.values, "ditch": (digging, CHECK_DEFAULT)})

    def _duration(self) -> float:
        """Return how long a release is simulated [s], in steps of 5 s."""
        length = float(np.hypot(np.diff(self.x), np.diff(self.y)).sum())
        return min(max(25.0, 5.0 * np.ceil(length / PROFILE_SPEED / 5.0)), 300.0)


def _traffic() -> Part:
    """Return the template of the traffic, without which the risk to life is not computed."""
    usual = Traffic(*PLACEHOLDER_TRAFFIC)
    given = dict(
        zip(("vehicles_per_day", "speed", "section_length"), PLACEHOLDER_TRAFFIC, strict=True)
    )
    kept = ("vehicle_length", "occupancy", "vulnerability_run_into", "commuter_trips")
    values = {name: (value, PLACEHOLDER) for name, value in given.items()}
    values |= {name: (getattr(usual, name), CHECK_DEFAULT) for name in kept}
    return Part("[traffic]", Traffic, values, template=True)


def _mass_tables(mass: Mass) -> tuple[Part, Part]:
    """Return the tables of a jointed mass and of its event."""
    joints = [{"dip_deg": dip, "spacing": spacing, "scatter": 0.2} for dip, spacing in JOINTS]
    source: dict[str, tuple[Any, str]] = {
        "name": (mass.name, GIVEN),
        "polygon": (mass.polygon, GIVEN),
        "joints": (joints, PLACEHOLDER),
        "density": (Source(band=(1.0, 2.0)).density, CHECK_DEFAULT),
        "surface": (Source(band=(1.0, 2.0)).surface, CHECK_DEFAULT),
    }
    event: dict[str, tuple[Any, str]] = {
        "name": (f"mass, {mass.name}", PLACEHOLDER),
        "source": (mass.name, GIVEN),
        "return_period": (MASS_PERIOD, PLACEHOLDER),
        "section_length": (100.0, PLACEHOLDER),
        "design": (True, PLACEHOLDER),
    }
    return Part("[[sources]]", Source, source), Part("[[events]]", Event, event)


JOINTED = (
    "A jointed mass instead of a band, which `rigdda new --mass` takes out of the ground:",
    "polygon = [[x, y], [x, y], [x, y], [x, y]]",
    "joints = [",
    "    { dip_deg = 45.0, spacing = 0.8, scatter = 0.2 },",
    "    { dip_deg = -50.0, spacing = 1.1, scatter = 0.2 },",
    "]",
)


def _mass_option(text: str, origin: Origin) -> tuple[str, Span, float]:
    """Return the name, the stretch in chainages of the site and the dip [deg] in an option."""
    found, span = MASS_OPTION.fullmatch(text.strip()), None
    if found is not None:
        try:
            name, span = _ranged("--mass", found[1], origin)
            dip = float(found[2])
        except ValueError:
            span = None
    if span is None:
        hint = 'give NAME:START-END:DIP, such as "pillar:8-15:40"'
        raise BadInput("--mass", text, hint)
    return name, span, dip


def _with_corners(points: Floats, chainages: Iterable[float]) -> Floats:
    """Return the corners of ground without overhangs, with a corner at each of some chainages."""
    for at in chainages:
        x, y = points.T
        if not (x == at).any():
            corner = at, round(float(np.interp(at, x, y)), CORNER_DIGITS)
            points = np.insert(points, np.searchsorted(x, at), corner, axis=0)
    return points


def _crack(points: Floats, low: float) -> tuple[int, int]:
    """Return the indices of the corners at which a crack meets the ground.

    The ground above the crack ends at the first one, and the face of the mass begins at the last
    one; they differ at a vertical face.
    """
    (at,) = np.nonzero(points[:, 0] == low)
    return int(at[0]), int(at[-1])


def _lower_end(points: Floats, high: float) -> int:
    """Return the index of the corner at which a mass ends, at the foot of a vertical face."""
    (at,) = np.nonzero(points[:, 0] == high)
    return int(at[points[at, 1].argmin()])


def _reach() -> float:
    """Return how far blocks of the placeholder reach beyond their band [m]."""
    event = Event("", return_period=PERIOD, volume=VOLUME)
    return loose_blocks.reach(Source(band=(1.0, 2.0)), event)


def _block(points: Floats, span: Span) -> list[list[float]]:
    """Return the corners of a block just above the highest ground of a face."""
    ground, low = Terrain(points), round(0.5 * sum(span), 3)
    high = round(low + BLOCK, 3)
    inner = [x for x in points[:, 0] if low < x < high]
    bottom = round(max(map(ground.height, [low, *inner, high])) + BLOCK_GAP, 3)
    top = round(bottom + BLOCK, 3)
    return [[low, bottom], [high, bottom], [high, top], [low, top]]


def _ranged(option: str, text: str, origin: Origin) -> tuple[str, Span | None]:
    """Return the name in an option, and the range in chainages of the site if there is one."""
    found = RANGE.fullmatch(text.strip())
    if found is None:
        name = text.strip()
        if not name or ":" in name:
            hint = 'give NAME:START-END with chainages, such as "talus:12-30"'
            raise BadInput(option, text, hint)
        return name, None
    try:
        span = float(found[2]), float(found[3])
    except ValueError:
        hint = 'give NAME:START-END with chainages, such as "talus:12-30"'
        raise BadInput(option, text, hint) from None
    low, high = sorted(map(origin.x_of, _sorted(option, span)))
    return found[1].strip(), (round(low, 6), round(high, 6))


def _library(word: str) -> tuple[str, str]:
    """Return the name of a surface and its ground by the name of a ground, or a part of it."""
    asked = word.casefold().replace(" ", "_").replace("-", "_")
    ground = USUAL.get(asked, asked)
    if ground not in GROUNDS:
        near = [name for name in GROUNDS if asked in name]
        if len(near) != 1:
            hint = f"name one of the grounds {', '.join(near or GROUNDS)}"
            raise BadInput("--ground", word, hint)
        ground = near[0]
    surface = {ground: name for name, ground in USUAL.items()}.get(ground, asked)
    return surface, ground


def _check_apart(given: Iterable[tuple[Span, str]], origin: Origin) -> None:
    """Check that no two stretches of ground overlap."""
    for (one, name), (two, other) in pairwise(sorted(given)):
        if two[0] < one[1]:
            start = origin.chainage_of(two[0])
            hint = (
                f"let it begin where {name} ends, at chainage "
                f"{chainage(origin.chainage_of(one[1]))}"
            )
            raise BadInput("--ground", f"{other} from chainage {chainage(start)}", hint)


def _head(name: str, file: Path, profile: Profile) -> list[str]:
    """Return the lines of comment at the top of the file."""
    return [
        f"Site {name}: the profile is that of {file.name}, all else is what a comment says of it.",
        f'"{SURVEYED}" and "{GIVEN}": from the survey, and from who made this file.',
        f'"{PLACEHOLDER}": a guess that only makes the file complete.',
        f'"{CHECK_DEFAULT}": a usual value, or an order of magnitude.',
        "x is the chainage in metres and grows downhill; y is the elevation in metres.",
        *(f"Import: {note}." for note in profile.notes),
        "`rigdda check FILE` draws this site and says what looks odd. All keys: docs/site.md.",
    ]


def _defaults(head: str, table: type[msgspec.Struct]) -> Part:
    """Return a table with the defaults of all its fields."""
    return Part(
        head, table, {field.name: (field.default, CHECK_DEFAULT) for field in described(table)}
    )


def _render(head: Sequence[str], parts: Iterable[Part]) -> str:
    """Return the text of a file: before each value a line that says what it is."""
    lines = [f"# {''.join(c if c.isprintable() else ' ' for c in line)}" for line in head]
    for part in parts:
        lines.append("")
        if part.template:
            lines += [f"# {line}" for line in (TEMPLATE, *_table(part))]
        else:
            lines += _table(part)
    return "\n".join(lines) + "\n"


def _table(part: Part) -> Iterator[str]:
    """Yield the lines of a table, with a comment before it and before each of its values."""
    if part.head:
        yield f"# {_first_sentence(part.table.__doc__ or '')}"
        yield part.head
    about = {field.name: field for field in described(part.table)}
    for key, (value, sure) in part.values.items():
        field = about[key]
        unit = "" if field.unit in ("", "-") else f" [{field.unit}]"
        yield f"# {_first_sentence(field.text).rstrip('.')}{unit}; {sure}."
        yield f"{key} = {_toml(value)}"
    yield from (f"# {line}" for line in part.comments)


def _first_sentence(text: str) -> str:
    """Return the first sentence of a text, in one line."""
    return re.split(r"(?<=\.)\s+(?=[A-Z`\"\[])", " ".join(text.split()))[0]


def _toml(value: Any) -> str:
    """Return a value as TOML: lists of lists and of tables over several lines."""
    if isinstance(value, dict):
        inner = ", ".join(f"{_key(key)} = {_toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}"
    if isinstance(value, list | tuple):
        items = [_toml(item) for item in value]
        if value and isinstance(value[0], list | tuple | dict):
            return "[\n" + "".join(f"    {item},\n" for item in items) + "]"
        return f"[{', '.join(items)}]"
    return tomli_w.dumps({"value": value}).partition(" = ")[2].strip()


def _key(name: str) -> str:
    """Return a key of TOML, in quotes where it needs them."""
    plain = re.fullmatch(r"[A-Za-z0-9_-]+", name)
    return name if plain else tomli_w.dumps({name: 0}).strip().removesuffix(" = 0")


def _pairs(points: Floats) -> list[list[float]]:
    """Return points as lists of two numbers."""
    return [[float(x), float(y)] for x, y in points]
