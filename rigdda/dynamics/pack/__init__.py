"""From a scene to the arrays that the kernels work on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigdda.dynamics.arrays import Ground, Monitors, Outlines, Work
from rigdda.dynamics.pack.bodies import free_bodies, pack_bodies, pack_links, start_fences
from rigdda.dynamics.pack.ground import pack_ground, pack_shaking
from rigdda.dynamics.pack.monitors import pack_monitors
from rigdda.dynamics.pack.parameters import pack_interfaces, pack_parameters
from rigdda.dynamics.pack.space import empty_contacts, empty_work
from rigdda.dynamics.records import Bodies, Contacts, Interfaces, Links, Shaking
from rigdda.model.scene import Scene
from rigdda.model.settings import Settings


class Arrays(NamedTuple):
    """Everything the step loop needs, for one scene."""

    bodies: Bodies
    outlines: Outlines
    ground: Ground
    interfaces: Interfaces
    links: Links
    shaking: Shaking
    now: Contacts
    before: Contacts
    work: Work
    monitors: Monitors
    parameters: NDArray[np.void]  # (1,) of PARAMETERS


def pack(
    scene: Scene,
    settings: Settings,
    stations: NDArray[np.float64],
    watch: tuple[float, float],
    leave: float = -math.inf,
) -> Arrays:
    """Return the kernels' arrays for a scene at rest at its start.

    Parameters
    ----------
    stations : (K,) array
        Ascending chainages whose first crossings are recorded [m].
    watch : (float, float)
        Interval of x in which energies are watched [m].
    leave : float
        x beyond which what moves on is left alone [m], -inf: the run is not ended early.
    """
    names = list(scene.surfaces)
    bodies, outlines = pack_bodies(scene, names)
    blocks = free_bodies(scene)
    room = 16 * blocks + 64
    interfaces = pack_interfaces(scene, names)
    parameters = pack_parameters(scene, settings, bodies, interfaces)
    start_fences(scene, bodies, parameters)
    return Arrays(
        bodies,
        outlines,
        pack_ground(scene.ground, names),
        interfaces,
        pack_links(scene, bodies),
        pack_shaking(scene),
        empty_contacts(room),
        empty_contacts(room),
        empty_work(len(bodies), blocks, room),
        pack_monitors(scene, bodies, stations, watch, leave, settings.dt),
        parameters,
    )
