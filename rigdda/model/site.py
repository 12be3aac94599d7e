"""What an engineer knows about a site, as a TOML file."""

from __future__ import annotations

import math
import os
import tomllib
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np
import tomli_w

from rigdda import sites
from rigdda.barriers import Barrier, Built, as_layout
from rigdda.check import mistyped
from rigdda.errors import BadInput, DoubtfulInput
from rigdda.files import atomic, read
from rigdda.geometry import polygon_properties
from rigdda.model import economy, realisation
from rigdda.model.economy import Bill
from rigdda.model.grounds import GROUNDS, OTHER, USUAL
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings, longest_step
from rigdda.model.site_tables import Drawn, Event, Rebound, SiteTables
from rigdda.model.soundness import check_damping, check_site
from rigdda.model.surface import Surface

if TYPE_CHECKING:
    from rigdda.results.outcome import Outcome


class Site(SiteTables, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What an engineer knows about a site: the tables of its file, sound together.

    Its parameters are those of `SiteTables`.

    Raises
    ------
    BadInput
        If a field is unknown, of the wrong type or at odds with another; the message names it.
    """

    def __post_init__(self) -> None:
        if not self.events:
            usual = tuple(Event(s.name, 1.0, s.name) for s in self.sources if s.band is None)
            if not usual:
                raise BadInput("events", (), "give at least one: what comes down, and how often")
            msgspec.structs.force_setattr(self, "events", usual)
        if self.motion.damping is None:
            check_damping(self.motion)
            msgspec.structs.force_setattr(self, "surfaces", _with_damping(self.surfaces))
        check_site(self)

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Site:
        """Read a site from a TOML file, or a built-in or generated one by its name.

        Raises
        ------
        BadInput
            If there is no such file or name, or the file is not a sound site.
        """
        if not isinstance(source, str | os.PathLike):
            raise BadInput("site", source, "name a TOML file or a built-in site")
        path = Path(source)
        if path.suffix != ".toml" and not path.is_file():
            return sites.load(str(source))
        if not path.is_file():
            raise BadInput("site", str(source), "name an existing TOML file")
        return cls.parse(read("site file", path), str(source))

    @classmethod
    def parse(cls, text: str, name: str) -> Site:
        """Return the site of a TOML text; errors call the file `name`.

        Raises
        ------
        BadInput
            If it is not a sound site.
        """
        try:
            return msgspec.toml.decode(text, type=cls)
        except msgspec.ValidationError as error:
            if isinstance(error.__cause__, BadInput):
                raise _placed(error.__cause__, str(error), text) from None
            bad = mistyped(str(error), msgspec.toml.decode(text))
            raise bad or BadInput("site file", name, str(error)) from None
        except (msgspec.DecodeError, RecursionError) as error:
            raise BadInput("site file", name, f"mend its TOML: {error}") from None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the site as TOML; `load` gives it back.

        Raises
        ------
        BadInput
            If a surface has the plain contact of restitution None, for which TOML has no word.
        """
        data = msgspec.to_builtins(self)
        for table in (*data["sources"], *data["events"], data["motion"]):  # TOML has no null
            for name in [name for name, value in table.items() if value is None]:
                del table[name]
        laws = {f"surfaces.{name}": table for name, table in data["surfaces"].items()}
        laws |= {f"interfaces[{i}]": table for i, table in enumerate(data["interfaces"])}
        for where, table in laws.items():
            if table["damping"] is None:
                del table["damping"]
            if table.get("ground") in GROUNDS:
                for name, value in GROUNDS[table["ground"]].values.items():
                    if table.get(name) == value:
                        del table[name]
            if table.get("restitution", 0.0) is None:
                mend = "give a number: a site file has no plain contact, only Python has"
                raise BadInput(f"{where}.restitution", None, mend)
        with atomic(path) as part:
            part.write_text(tomli_w.dumps(data), encoding="utf-8")

    def pick(self, seed: int) -> str:
        """Return the name of the event that a seed draws by rate."""
        return realisation.pick(self, seed)

    @property
    def rooms(self) -> tuple[tuple[float, float], ...]:
        """Intervals of the zone in which barriers may stand [m]: those without loose rock.

        Around a band so much is left out as its largest block reaches beyond it.
        """
        return realisation.rooms(self)

    def settings(self, scene: Scene) -> Settings:
        """Return the numerical settings of the scene of a release.

        The step is that of the site, or the longest whole part of it that is not too long for the
        blocks.
        """
        areas = [polygon_properties(b.vertices)[0] for b in scene.blocks if not b.fixed]
        most = longest_step(np.array(areas), math.hypot(*scene.gravity_vector))
        return Settings(dt=self.motion.dt / max(1, math.ceil(self.motion.dt / most)))

    def draw(self, seed: int = 0, event: str | None = None) -> Drawn:
        """Return what a seed draws of an event, or of one that it draws by rate.

        Raises
        ------
        BadInput
            If there is no such event, or the seed is not a whole number >= 0.
        """
        return realisation.draw(self, seed, event)

    def built(self, layout: Sequence[Barrier], width: float) -> tuple[Built, ...]:
        """Return what stands of a layout, as it resists an event of this width [m].

        Raises
        ------
        BadInput
            If a barrier stands where loose rock lies, or a mesh is not one of the options.
        """
        return realisation.built(self, layout, width)

    def scene(self, drawn: Drawn, barriers: Sequence[Built] = ()) -> Scene:
        """Return the scene of what was drawn, with barriers as `built` gives them."""
        return realisation.scene(self, drawn, barriers)

    def realise(
        self, layout: Sequence[Barrier] = (), seed: int = 0, event: str | None = None
    ) -> Scene:
        """Return the scene of one release of an event, or of one that the seed draws by rate.

        Blocks and friction are the same for every layout. Mesh is not part of a scene.

        Raises
        ------
        BadInput
            If a barrier does not stand on the slope or stands where loose rock lies, there is no
            such event, or the seed is not a whole number >= 0.
        """
        drawn = self.draw(seed, event)
        return self.scene(drawn, self.built(layout, drawn.width))

    def strength(self, drawn: Drawn) -> tuple[dict[str, Surface], dict[tuple[str, str], Surface]]:
        """Return the surfaces and how pairs meet in a release, with what was drawn of them."""
        return realisation.strength(self, drawn)

    def access(self, x: float) -> float:
        """Return the factor on prices at a chainage: dearer the higher above the road [-]."""
        rise = self.profile.height(x) - self.profile.height(self.road.start)
        return 1.0 + self.prices.access * max(rise, 0.0) / economy.ACCESS_HEIGHT

    def rate(self, event: str, layout: Sequence[Barrier] = ()) -> float:
        """Return how often an event happens with the mesh of a layout [1/year per metre of slope].

        Raises
        ------
        BadInput
            If there is no such event or mesh option, or an option is there twice.
        """
        return economy.rate(self, event, layout)

    def capital(self, layout: Sequence[Barrier]) -> float:
        """Return what a layout costs to build [EUR per metre of road].

        Raises
        ------
        BadInput
            If an earthwork does not fit, or a barrier has no price.
        """
        return float(sum(economy.capitals(self, as_layout(layout))))

    def annual(self, layout: Sequence[Barrier]) -> float:
        """Return what a layout costs a year, upkeep included [EUR per metre of road and year].

        Raises as `capital` does.
        """
        standing = as_layout(layout)
        each = zip(standing, economy.capitals(self, standing), strict=True)
        return float(sum(price * self.prices.annual(b.kind) for b, price in each))

    def bill(self, layout: Sequence[Barrier], outcome: Outcome) -> Bill:
        """Return what a release with a layout costs [EUR per occurrence of its event]."""
        return economy.bill(self, as_layout(layout), outcome)

    def shed(self) -> float:
        """Return what a rock shed over the road costs a year [EUR per metre of road and year].

        A reference: nothing reaches the road below it.
        """
        return self.prices.shed * self.prices.annual("shed")


def _with_damping(surfaces: dict[str, Surface]) -> dict[str, Surface]:
    """Return surfaces of which those without a damping have that of their usual ground.

    Warns
    -----
    DoubtfulInput
        For each of these.
    """
    found = dict(surfaces)
    for name, surface in surfaces.items():
        if surface.damping is None:
            ground = USUAL.get(name, OTHER)
            value = GROUNDS[ground].damping.typical
            warnings.warn(
                f"neither surfaces.{name}.damping nor motion.damping is given: {value:g} 1/s is "
                f"used, typical of {ground!r}; set surfaces.{name}.ground or .damping",
                DoubtfulInput,
                stacklevel=4,
            )
            found[name] = msgspec.structs.replace(surface, damping=value)
    return found


def _placed(bad: BadInput, told: str, text: str) -> BadInput:
    """Return an error with the table that its field is of, if it is a bare name.

    `told` is what msgspec says of it, which ends with the path, but for the keys of tables.
    """
    path = told.rpartition(" - at `$.")[2].rstrip("`")
    if not bad.field.isidentifier() or not path or " " in path:
        return bad
    head = path.partition("[...]")[0]
    if head != path:
        kind = {"surfaces": Surface, "lumped": Rebound}.get(head)
        tables = tomllib.loads(text)[head] if kind is not None else {}
        head = next((f"{head}.{name}" for name in tables if _is_bad(tables[name], kind)), head)
    return BadInput(f"{head}.{bad.field}", bad.value, bad.mend)


def _is_bad(table: object, kind: type | None) -> bool:
    try:
        msgspec.convert(table, kind)
    except msgspec.ValidationError:
        return True
    return False
