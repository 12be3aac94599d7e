"""Replays of runs as .rrd files for the Rerun viewer.

Geometry is logged once, and poses and scalars as columns over time. The world is in metres with y
up and is seen through a distant pinhole camera, which gives a flat view of filled shapes; z only
sets the order of layers. The viewer shows the slope, with notes and plots at its side and the
timeline below.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol
from uuid import uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
import shapely
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from rigdda import check
from rigdda.barriers import describe
from rigdda.barriers.base import STANDS
from rigdda.errors import BadInput
from rigdda.files import atomic, is_file
from rigdda.geometry import polygon_properties
from rigdda.ground.terrain import Terrain
from rigdda.model.scene import Scene
from rigdda.replay.viewer import rrd_path

Colour = tuple[int, int, int]
Floats = NDArray[np.float64]


class RecordedMotion(Protocol):
    """Interface of a run as needed by replays, implemented by `rigdda.Run`."""

    @property
    def scene(self) -> Scene:
        """The simulated scene."""

    @property
    def times(self) -> Floats:
        """(T,) times of the frames [s]."""

    @property
    def poses(self) -> Floats:
        """(T, N, 3) poses of the blocks [m, m, rad]."""

    @property
    def velocities(self) -> Floats:
        """(T, N, 3) rates of the poses [m/s, m/s, rad/s]."""

    @property
    def barrier_poses(self) -> Floats:
        """(T, B, 3) poses of the barriers [m, m, rad]."""

    @property
    def ground(self) -> Terrain | None:
        """The ground at the end."""

    def passed(self, x: float) -> NDArray[np.bool_]:
        """Return whether each block has been at or past a chainage by each frame."""

    def outline(self, barrier: int, frame: int) -> Floats:
        """Return the (n, 2) corners of a barrier in a frame [m]."""

    def failure(self, barrier: int) -> float:
        """Return the time at which a barrier failed, inf if it did not fail [s]."""

    def states(self, barrier: int) -> list[tuple[float, str]]:
        """Return the successive states of a barrier, each with the time at which it begins [s]."""


CAMERA = 1000.0
"""Distance of the camera [m]. One pixel is one metre, and a layer shifts a point by 1e-5."""
LAYER = {"terrain": 0.0, "barriers": 0.02, "road": 0.04, "blocks": 0.06}
LABEL = 0.05
"""Height of a label above the top of its barrier, as a fraction of the view. Labels use three
heights in turn."""
DOT = -3.0
"""Radius of the dot of a label; negative numbers are screen points."""
EDGE = 0.01
"""z offset of an outline above its fill [m]."""

APPLICATION = "rigdda"
"""Name of the application in recordings."""

SKY: Colour = (233, 240, 246)
GROUND_RGB: Colour = (201, 188, 165)
BARRIER_RGB: Colour = (28, 90, 160)
BROKEN_RGB: Colour = (176, 182, 188)
FAILED_BARRIER: Colour = (214, 40, 70)
ROAD_RGB: Colour = (232, 93, 4)
ROCKS_RGB: tuple[Colour, ...] = ((104, 88, 74), (128, 108, 90), (88, 80, 76), (146, 122, 98))
INK: Colour = (40, 34, 30)


def frame(scene: Scene) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top of a view of the whole scene at its start [m]."""
    parts = [block.vertices for block in scene.blocks]
    if scene.ground is not None:
        parts += [scene.ground.points, *(scene.outline(i) for i in range(len(scene.barriers)))]
    points = np.concatenate(parts)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.04 * float((high - low).max())
    left, bottom = (low - margin).tolist()
    right, top = (high + margin).tolist()
    return left, bottom, right, top


@dataclass(frozen=True, slots=True)
class Marks:
    """Information for a replay that the scene lacks.

    Parameters
    ----------
    road : (float, float), optional
        Chainages of the road's uphill and downhill edges [m].
    notes : mapping of str to str
        Notes about the episode: seed, layout, reward, objective.
    title : str
        Name of the recording.
    labels : sequence of str
        Name of each barrier of the scene, a fence with its class; if empty, the descriptions by
        the scene are used.
    record : str
        All inputs needed to compute the episode again, as JSON; stored in the file but not shown.

    Raises
    ------
    BadInput
        If the road is not an interval.
    """

    road: tuple[float, float] | None = None
    notes: Mapping[str, str] = field(default_factory=dict)
    title: str = "rockfall"
    labels: Sequence[str] = ()
    record: str = ""

    def __post_init__(self) -> None:
        if self.road is None:
            return
        uphill, downhill = check.interval("road", self.road)
        if uphill == downhill:
            raise BadInput("road", self.road, "give its uphill edge, then its downhill edge")

    def labels_of(self, scene: Scene) -> Sequence[str]:
        """Return the name of each barrier of a scene.

        Raises
        ------
        BadInput
            If there are labels, but not one for each barrier.
        """
        count = len(scene.barriers)
        if self.labels and len(self.labels) != count:
            hint = f"give one for each of {count} barriers, or none"
            raise BadInput("labels", self.labels, hint)
        return self.labels or [describe(barrier) for barrier in scene.barriers]


MOVING_SPEED = 0.1
"""Speed above which a block counts as moving [m/s]; a slower block creeps less than 1 m in 10 s."""

PLOTS = {
    "kinetic_energy": ("kinetic energy [J]", ROAD_RGB),
    "debris": ("debris past the road's edge [share of mass]", (214, 40, 70)),
    "greatest_speed": ("greatest speed [m/s]", (150, 90, 200)),
    "moving": ("moving blocks", (40, 150, 90)),
    "potential_energy": ("potential energy [J]", (60, 130, 210)),
}
"""Title and colour of every scalar."""


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a recording that this package wrote."""
    try:
        found = RrdReader(str(path)).recordings()
        return any(recording.application_id == APPLICATION for recording in found)
    except (OSError, ValueError, RuntimeError):
        return False


def scalars(run: RecordedMotion, marks: Marks) -> dict[str, Floats]:
    """Return the (T,) values of every plot for the free blocks; debris only if there is a road."""
    free = np.array([not block.fixed for block in run.scene.blocks])
    shapes = [polygon_properties(block.vertices) for block in run.scene.blocks]
    density = np.array([block.density for block in run.scene.blocks])
    mass = (density * [area for area, _, _ in shapes])[free]
    inertia = (density * [moment for _, _, moment in shapes])[free]
    vx, vy, omega = np.moveaxis(run.velocities[:, free], -1, 0)
    squared = vx**2 + vy**2
    x, y = run.poses[:, free, 0], run.poses[:, free, 1] - frame(run.scene)[1]
    gx, gy = run.scene.gravity_vector
    out = {
        "kinetic_energy": 0.5 * (squared @ mass + omega**2 @ inertia),
        "potential_energy": -(gx * x + gy * y) @ mass,
        "greatest_speed": np.sqrt(squared.max(axis=1)),
        "moving": np.count_nonzero(squared > MOVING_SPEED**2, axis=1).astype(np.float64),
    }
    if marks.road is not None:
        out["debris"] = run.passed(marks.road[0])[:, free] @ mass / mass.sum()
    return out


TIMELINE = "sim_time"
PLACEMENT = "placement"
"""Timeline of an episode in which barriers are placed one by one."""


def slope_view(run: RecordedMotion, name: str, root: str = "") -> rrb.Spatial2DView:
    """Return the view of the slope for a run that is logged below the entity `root`."""
    left, bottom, right, top = frame(run.scene)
    return rrb.Spatial2DView(
        origin=f"{root}/world/camera",
        contents=f"{root}/world/**",
        name=name,
        background=SKY,
        visual_bounds=rrb.VisualBounds2D(x_range=(0, right - left), y_range=(0, top - bottom)),
    )


def run_blueprint(run: RecordedMotion, marks: Marks) -> rrb.Blueprint:
    """Return the viewer layout: the slope, with notes and plots at its side."""
    slope = slope_view(run, marks.title)
    plots = {
        name: rrb.TimeSeriesView(
            origin=f"/plots/{name}",
            name=title,
            axis_y=rrb.ScalarAxis(range=(0.0, 1.05)) if name == "debris" else None,
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for name, (title, _) in PLOTS.items()
    }
    debris = plots.pop("debris")
    side: list[rrb.Container | rrb.View] = [
        plots.pop("kinetic_energy"),
        rrb.Tabs(*plots.values()),
    ]
    if marks.road is not None:
        side = [debris, *side]
    notes = rrb.TextDocumentView(origin="/notes", name="episode")
    column = rrb.Vertical(notes, *side, row_shares=[1.4] + [1.0] * len(side))
    return rrb.Blueprint(
        rrb.Horizontal(slope, column, column_shares=[5, 2]),
        rrb.TimePanel(timeline=TIMELINE, play_state="playing", loop_mode="all", state="collapsed"),
        collapse_panels=True,
    )


Clock = Callable[[Sequence[float] | Floats], list[rr.TimeColumn]]
"""Function that returns the time columns for rows at given times [s]."""


def write_rerun(
    run: RecordedMotion, path: str | os.PathLike[str], marks: Marks | None = None
) -> None:
    """Write `run` as a Rerun recording with geometry, poses, scalars and a viewer layout.

    Parameters
    ----------
    run : Run
        The run.
    path : path
        The .rrd file; an existing one is replaced when the new one is complete.
    marks : Marks, optional
        The road and notes about the episode.

    Raises
    ------
    BadInput
        If the file name does not end in .rrd.
    """
    marks = marks or Marks()
    with recording(path, run_blueprint(run, marks)) as rec:
        rec.send_recording_name(marks.title)
        log_run(rec, run, marks)
        log_record(rec, marks.record)


RECORD = "/record"
"""Entity of the inputs needed to compute an episode again."""


def log_record(rec: rr.RecordingStream, record: str) -> None:
    """Log the inputs needed to compute an episode again, if there are any."""
    if record:
        rec.log(RECORD, rr.TextDocument(record, media_type="application/json"), static=True)


def read_record(path: str | os.PathLike[str]) -> str:
    """Return the inputs stored in a replay for computing its episode again, as JSON.

    Raises
    ------
    BadInput
        If the file is missing, is not a replay or contains no such inputs.
    """
    file = rrd_path(path)
    if not is_file(file):
        raise BadInput("replay file", str(path), "name an existing .rrd file")
    try:
        chunks = RrdReader(file).stream().filter(content=RECORD, is_static=True).to_chunks()
    except (ValueError, RuntimeError, OSError) as error:
        hint = f"name a whole .rrd file that rigdda recorded ({error})"
        raise BadInput("replay file", str(path), hint) from None
    if not chunks:
        hint = "name one that an environment, `rigdda design` or `rigdda replay SITE` recorded"
        raise BadInput("replay file", str(path), hint)
    ((text,),) = chunks[0].to_record_batch().column("TextDocument:text").to_pylist()
    return str(text)


@contextlib.contextmanager
def recording(
    path: str | os.PathLike[str], blueprint: rrb.Blueprint
) -> Iterator[rr.RecordingStream]:
    """Yield a separate recording stream, saved at `path` when the block ends without an error."""
    with atomic(rrd_path(path)) as part:
        rec = rr.RecordingStream(APPLICATION, recording_id=uuid4())
        try:
            rec.save(part, default_blueprint=blueprint)
            yield rec
            rec.flush()
        finally:
            rec.disconnect()


def log_run(
    rec: rr.RecordingStream,
    run: RecordedMotion,
    marks: Marks,
    root: str = "",
    placement: int | None = None,
) -> None:
    """Log a whole run below the entity `root`, with frames at a `placement` if one is given.

    Raises
    ------
    BadInput
        If there are labels, but not one for each barrier.
    """
    labels = marks.labels_of(run.scene)

    def clock(times: Sequence[float] | Floats) -> list[rr.TimeColumn]:
        columns = [rr.TimeColumn(TIMELINE, duration=times)]
        if placement is not None:
            columns.append(rr.TimeColumn(PLACEMENT, sequence=[placement] * len(times)))
        return columns

    _log_setting(rec, f"{root}/world", run, marks)
    for i, label in enumerate(labels):
        _log_barrier(rec, f"{root}/world/barriers/{i}", clock, run, i)
        _log_state(rec, f"{root}/world/labels/{i}", clock, run, i, label)
    for i in range(len(run.scene.blocks)):
        _log_block(rec, f"{root}/world/blocks/{i}", clock, run, i)
    for name, values in scalars(run, marks).items():
        title, colour = PLOTS[name]
        style = rr.SeriesLines(names=title, colors=colour, widths=2.0)
        rec.log(f"{root}/plots/{name}", style, static=True)
        rec.send_columns(
            f"{root}/plots/{name}", clock(run.times), rr.Scalars.columns(scalars=values)
        )
    words = [f"## {marks.title}", *(f"**{key}**: {text}" for key, text in marks.notes.items())]
    page = rr.TextDocument("\n\n".join(words), media_type="text/markdown")
    rec.log(f"{root}/notes", page, static=True)


def _log_setting(rec: rr.RecordingStream, world: str, run: RecordedMotion, marks: Marks) -> None:
    """Log the static parts: the camera, the ground at the end of the run and the road."""
    left, bottom, right, top = frame(run.scene)
    rec.log(world, rr.ViewCoordinates.RIGHT_HAND_Y_UP, static=True)
    eye = rr.Transform3D(translation=[(left + right) / 2, (bottom + top) / 2, CAMERA])
    lens = rr.Pinhole(
        focal_length=CAMERA,
        width=right - left,
        height=top - bottom,
        camera_xyz=rr.ViewCoordinates.RUB,
        image_plane_distance=CAMERA,
    )
    rec.log(f"{world}/camera", eye, lens, static=True)
    ground = run.ground
    if ground is None:
        return
    chain = ground.points
    surface = shapely.LineString(chain)
    _log_shape(
        rec, f"{world}/terrain", _ground(chain, bottom), LAYER["terrain"], GROUND_RGB, surface
    )
    if marks.road is not None:
        start, end = marks.road
        road = shapely.clip_by_rect(surface, start, bottom, end, top)
        strips = [_lift(piece, LAYER["road"]) for piece in shapely.get_parts(road)]
        line = rr.LineStrips3D(strips, colors=ROAD_RGB, radii=rr.Radius.ui_points(3.0))
        rec.log(f"{world}/road", line, static=True)


def _log_barrier(
    rec: rr.RecordingStream, entity: str, clock: Clock, run: RecordedMotion, i: int
) -> None:
    """Log barrier `i`: walls and fences move, failed barriers turn pale, ditches are lines."""
    barrier, z = run.scene.barriers[i], LAYER["barriers"]
    outline = run.scene.outline(i)
    if barrier.drawn == "line":
        edge = np.insert(np.concatenate([outline, outline[:1]]), 2, z + EDGE, axis=1)
        line = rr.LineStrips3D([edge], colors=BARRIER_RGB, radii=rr.Radius.ui_points(1.5))
        rec.log(entity, line, static=True)
        return
    if barrier.drawn == "moving":
        body = shapely.Polygon(outline - polygon_properties(outline)[1])
        _log_shape(rec, entity, body, 0.0, BARRIER_RGB)
        _log_motion(rec, entity, clock(run.times), run.barrier_poses[:, i], z)
        return
    failure = run.failure(i)
    colour = BARRIER_RGB if np.isinf(failure) else None
    if np.ptp(run.barrier_poses[:, i, 0]) > 0.0:
        _log_deflection(rec, entity, clock, run, i, colour)
    else:
        _log_shape(rec, entity, shapely.Polygon(outline), z, colour)
    if np.isfinite(failure):
        when = clock([run.times[0], failure])
        rec.send_columns(entity, when, rr.Mesh3D.columns(albedo_factor=[BARRIER_RGB, BROKEN_RGB]))


def _log_deflection(
    rec: rr.RecordingStream, entity: str, clock: Clock, run: RecordedMotion, i: int,
    colour: Colour | None,
) -> None:  # fmt: skip
    """Log barrier `i`, a fence, in each frame in which its outline differs from the last one."""
    place = run.barrier_poses[:, i, 0]
    frames = np.flatnonzero(np.diff(place, prepend=np.nan) != 0.0)
    corners = np.array([run.outline(i, int(frame)) for frame in frames])
    fill = np.insert(corners, 2, LAYER["barriers"], axis=2)
    edge = np.insert(np.concatenate([corners, corners[:, :1]], axis=1), 2, LAYER["barriers"] + EDGE,
                     axis=2)  # fmt: skip
    triangles = [(0, 1, 2), (0, 2, 3)]
    faces = rr.Mesh3D.from_fields(triangle_indices=triangles, albedo_factor=colour)
    line = rr.LineStrips3D.from_fields(colors=INK, radii=rr.Radius.ui_points(0.6))
    rec.log(entity, faces, line, static=True)
    positions = rr.Mesh3D.columns(vertex_positions=fill.reshape(-1, 3))
    strips = rr.LineStrips3D.columns(strips=edge)
    when = clock(run.times[frames])
    rec.send_columns(entity, when, [*positions.partition([fill.shape[1]] * len(frames)), *strips])


def _log_state(
    rec: rr.RecordingStream, entity: str, clock: Clock, run: RecordedMotion, i: int, label: str
) -> None:
    """Log the name and state of barrier `i` over time as a label above its top."""
    outline, changes = run.scene.outline(i), run.states(i)
    x, top = float(outline[:, 0].mean()), float(outline[:, 1].max())
    left, bottom, right, high = frame(run.scene)
    lift = LABEL * max(right - left, high - bottom) * (1 + i % 3)
    place = (x, top + lift, LAYER["blocks"] + EDGE)
    colours = [BARRIER_RGB if state == STANDS else FAILED_BARRIER for _, state in changes]
    rec.send_columns(
        entity,
        clock([time for time, _ in changes]),
        rr.Points3D.columns(
            positions=[place] * len(changes),
            labels=[f"{label}: {state}" for _, state in changes],
            colors=colours,
            radii=[DOT] * len(changes),
            show_labels=[True] * len(changes),
        ),
    )


def _log_motion(
    rec: rr.RecordingStream, entity: str, when: list[rr.TimeColumn], poses: Floats, z: float
) -> None:
    """Log the position of a body in every frame, from its poses, (T, 3)."""
    x, y, theta = poses.T
    still = np.zeros_like(theta)
    columns = rr.Transform3D.columns(
        translation=np.column_stack([x, y, still + z]),
        quaternion=np.column_stack([still, still, np.sin(theta / 2), np.cos(theta / 2)]),
    )
    rec.send_columns(entity, when, columns)


def _log_block(
    rec: rr.RecordingStream, entity: str, clock: Clock, run: RecordedMotion, i: int
) -> None:
    """Log block `i`: its polygon about its centroid, and its pose in every frame."""
    block = run.scene.blocks[i]
    body = block.vertices - polygon_properties(block.vertices)[1]
    colour = GROUND_RGB if block.fixed else ROCKS_RGB[i % len(ROCKS_RGB)]
    _log_shape(rec, entity, shapely.Polygon(body), 0.0, colour)
    _log_motion(rec, entity, clock(run.times), run.poses[:, i], LAYER["blocks"])


def _log_shape(
    rec: rr.RecordingStream,
    entity: str,
    shape: shapely.Geometry,
    z: float,
    colour: Colour | None,
    outline: shapely.Geometry | None = None,
) -> None:
    """Log `shape` filled with `colour`, and its `outline` (by default, all edges) in ink.

    If `colour` is None, the colour must be logged over time.
    """
    valid = shapely.make_valid(shape)  # parts of an earthwork may join at a point
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(valid))
    corners = [_lift(triangle, z)[:3] for triangle in triangles]  # the fourth closes the ring
    edge = _lift(outline or shape, z + EDGE)
    fill = rr.Mesh3D(vertex_positions=np.concatenate(corners), albedo_factor=colour)
    line = rr.LineStrips3D([edge], colors=INK, radii=rr.Radius.ui_points(0.6))
    rec.log(entity, fill, line, static=True)


def _lift(shape: shapely.Geometry, z: float) -> Floats:
    """Return the corners of `shape` as (n, 3) points at height `z` above the drawing plane."""
    return np.insert(shapely.get_coordinates(shape), 2, z, axis=1)


def _ground(chain: Floats, bottom: float) -> shapely.Geometry:
    """Return the ground below a chain, which may have overhangs, down to the level `bottom`."""
    left, right = chain[:, 0].min(), chain[:, 0].max()
    closing = [(right, chain[-1, 1]), (right, bottom), (left, bottom), (left, chain[0, 1])]
    return shapely.make_valid(shapely.Polygon([*chain, *closing]))
