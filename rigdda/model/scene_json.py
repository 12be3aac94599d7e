"""Scenes as JSON."""

from __future__ import annotations

import msgspec

from rigdda.barriers import from_table, to_tables
from rigdda.model.block import Block
from rigdda.model.loads import BodyForce, LineLoad, PointLoad
from rigdda.model.roughness import Roughness
from rigdda.model.scene import Scene
from rigdda.model.supports import Bolt, FixedPoint
from rigdda.model.surface import Surface
from rigdda.model.terrain import Terrain

LOADS = {kind.__name__: kind for kind in (PointLoad, LineLoad, BodyForce)}
SUPPORTS = {kind.__name__: kind for kind in (FixedPoint, Bolt)}


def scene_to_json(scene: Scene) -> bytes:
    """Return a scene as JSON; numbers survive exactly."""
    return msgspec.json.encode(
        {
            "terrain": scene.terrain
            and {
                "points": scene.terrain.points.tolist(),
                "surfaces": scene.terrain.surfaces,
            },
            "blocks": [
                {
                    "vertices": b.vertices.tolist(),
                    "density": b.density,
                    "surface": b.surface,
                    "velocity": b.velocity,
                    "fixed": b.fixed,
                }
                for b in scene.blocks
            ],
            "surfaces": scene.surfaces,
            "barriers": to_tables(scene.barriers),
            "interfaces": [[*pair, surface] for pair, surface in scene.interfaces.items()],
            "loads": [[type(load).__name__, load] for load in scene.loads],
            "supports": [[type(support).__name__, support] for support in scene.supports],
            "base_motion": scene.base_motion is not None and scene.base_motion.tolist(),
            "gravity": scene.gravity,
            "damping": scene.damping,
            "damping_when": scene.damping_when,
            "roughness": scene.roughness,
        }
    )


def scene_from_json(text: bytes) -> Scene:
    """Return the scene that `scene_to_json` wrote.

    Raises
    ------
    BadInput
        If a value in it is not sound.
    """
    data = msgspec.json.decode(text)
    terrain, roughness = data.pop("terrain"), data.pop("roughness", None)
    return Scene(
        terrain=terrain and Terrain(**terrain),
        blocks=tuple(Block(**b) for b in data.pop("blocks")),
        surfaces={name: Surface(**s) for name, s in data.pop("surfaces").items()},
        barriers=tuple(
            from_table(f"barriers[{i}]", table) for i, table in enumerate(data.pop("barriers"))
        ),
        interfaces={(a, b): Surface(**s) for a, b, s in data.pop("interfaces")},
        loads=tuple(LOADS[name](**load) for name, load in data.pop("loads")),
        supports=tuple(SUPPORTS[name](**support) for name, support in data.pop("supports")),
        base_motion=data.pop("base_motion") or None,
        roughness=roughness and msgspec.convert(roughness, Roughness),
        **data,
    )
