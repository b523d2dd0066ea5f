"""InSpace: a recorded run in 3-D, by MuJoCo's renderer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import atan

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.dashboard.recorded.scenes import scenes_of
from rems_net.drivers.physics.pictures.painter import look_for_renderer
from rems_net.errors import ExperimentError
from rems_net.films.actor import Actor, actors
from rems_net.films.model import DrawnModel, Ink, Scene
from rems_net.kinematics.pose import Pose
from rems_net.recordings.animation.film import SIZE
from rems_net.recordings.picture import COLOURS
from rems_net.recordings.recording import Recording

#: rad. From where everything is seen, as on the page: direction and height.
YAW, PITCH = -1.2, 0.6
#: slope of the upper edge of the picture, and the share of the picture that is used
SLOPE, USED = 0.365, 0.9
#: times at which the camera looks for what must be in the picture
LOOKS = 40
#: robots that leave trails, and the pieces of each
TRAILS, PIECES = 12, 150
#: m. A robot that moves less leaves no trail; nor is there a shorter piece of one.
STILL, SHORT = 0.01, 1e-5
#: opacity of ghosts and of trails
GHOST, TRAIL = 0.35, 0.7
#: times the distance of the camera: what is nearer, or further away, is not drawn
NEAR, FAR = 0.02, 50.0
#: A ramp is steeper than this and less steep than that: height of its unit normal.
STEEP, LEVEL = 0.7, 0.9999


class InSpace:
    """Robots in their places, in 3-D, with their trails. `close` it at the end.

    Raises MissingPartError without a renderer, and ExperimentError if the recording
    does not describe what was there.
    """

    def __init__(self, recording: Recording):
        look_for_renderer("A film in 3-D", "Or leave out --3d.")
        scenes = scenes_of(recording.manifest())
        every = [*actors(recording, scenes)]
        self._robots = [one for one in every if one.key.startswith("robot/")]
        self._things = [one for one in every if one.key.startswith("world/")]
        times = [one.curves.times for one in self._robots if one.curves is not None]
        if not times:
            raise ExperimentError(
                f"the recording in {recording.folder} does not describe a robot that "
                "has a place, so nothing can be drawn in 3-D; draw its fields: rems "
                "plot. (R0845)"
            )
        self.names: Sequence[str] = [one.key.split("/")[1] for one in self._robots]
        self.begin = float(min(one[0] for one in times))
        self.end = float(max(one[-1] for one in times))
        self.model = model = DrawnModel()
        self._trails = [*self._ways()]
        _add_places(model, scenes)
        ghosts = _ghosts(self._robots)
        for number, robot in enumerate(self._robots):
            ink = _ink(number, GHOST if robot in ghosts else 1.0)
            model.body(robot.key, robot.scene, ink)
        for thing in self._things:
            red, green, blue = thing.scene["colour"]
            ink = red, green, blue, GHOST if thing.is_ghost else 1.0
            model.body(thing.key, thing.scene, ink, thing.key.rpartition("/")[0])
        model.build()
        self._look()

    def _ways(self) -> Iterator[tuple[range, Array]]:
        """Yield the pieces of each trail and the times of their ends, s."""
        times = np.linspace(self.begin, self.end, PIECES)
        for number, robot in enumerate(self._robots[:TRAILS]):
            poses = [robot.pose(now) for now in times.tolist()]
            points = np.array([pose.position[:2] for pose in poses if pose is not None])
            if np.ptp(points, axis=0).max() > STILL:
                steps = np.abs(np.diff(points, axis=0)).max(axis=1)
                moved = np.r_[True, steps > SHORT]
                ink = _ink(number, TRAIL)
                yield self.model.trail(points[moved], ink), times[moved][1:]

    def _look(self) -> None:
        """Put the camera to where everything is seen, always."""
        corners = []
        for now in np.linspace(self.begin, self.end, LOOKS).tolist():
            self._pose(now)
            corners += [*self.model.bounds()]
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        back = Pose.of(yaw=YAW, pitch=-PITCH).rotation[:, 0]
        right = np.array([-np.sin(YAW), np.cos(YAW), 0.0])
        up = np.cross(back, right)
        ratio, half = SIZE[0] / SIZE[1], (high - low) / 2
        far = 0.0
        for corner in (half * signs for signs in product((-1, 1), repeat=3)):
            aside = max(abs(corner @ right) / ratio, abs(corner @ up))
            far = max(far, float(corner @ back + aside / SLOPE / USED))
        self._view = (low + high) / 2 + far * back, -back, up
        self.model.fit((low + high) / 2, float(np.sqrt(half @ half)))
        wanted = 2 * atan(SLOPE * ratio)
        self._camera = Camera("film", (0, 0, 0), (1, 0, 0), *SIZE, wanted)
        depths = NEAR * far, FAR * far
        self._painter = self.model.painter(self._camera, depths)

    def _pose(self, now: float) -> None:
        """Put everything to where it was at a time [s]."""
        model = self.model
        ramps: list[tuple[Pose, Array]] = []
        for thing in self._things:
            model.show(thing.key, thing.is_there(now))
            if (pose := thing.pose(now)) is not None:
                model.put(thing.key, pose)
                boxes = (one.get("box") for one in thing.scene.get("solids", ())[:1])
                ramps += [(pose, np.array(box)) for box in boxes if box]
        for robot in self._robots:
            pose = robot.pose(now)
            assert pose is not None
            if robot.stands(now):
                pose = _standing(pose, robot.scene.get("height", 0.0), ramps)
            model.put(robot.key, pose)
            for number, link in enumerate(robot.scene.get("links", ())):
                if link["field"]:
                    unit = "m" if link["slides"] else "rad"
                    value = robot.read(now, link["field"], unit) or 0.0
                    model.bend(robot.key, number, value * link["ratio"])
        for pieces, ends in self._trails:
            model.uncover(pieces, ends <= now)
        model.move()

    def picture(self, now: float) -> NDArray[np.uint8]:
        """Return the picture at a time [s]."""
        self._pose(now)
        return self._painter.picture(self._camera, *self._view)

    def close(self) -> None:
        """Release the renderer."""
        self._painter.close()


def _add_places(model: DrawnModel, scenes: Mapping[str, Scene]) -> None:
    """Add all walls, each once: robots that are alone have an arena each."""
    rings = {}
    for key, scene in scenes.items():
        place = scene if key.startswith("world/") else scene.get("arena", {})
        model.place(key, place)
        rings[place.get("radius", 0.0)] = place.get("height", 0.1)
    for radius, height in rings.items():
        model.ring(radius, height)


def _ghosts(robots: Sequence[Actor]) -> list[Actor]:
    """Return the robots that are another one, done otherwise: they may overlap.

    Robots of one world meet each other, so none is a ghost.
    """
    if any("arena" not in one.scene for one in robots):
        return []
    made = [one.scene.get("made_of") for one in robots]
    return [one for n, one in enumerate(robots) if made[n] and made[n] in made[:n]]


def _ink(number: int, opacity: float) -> Ink:
    """Return the colour of the robot with this number."""
    colour = COLOURS[number % len(COLOURS)]
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue, opacity


def _standing(pose: Pose, height: float, ramps: Sequence[tuple[Pose, Array]]) -> Pose:
    """Return the pose of a robot on the floor, or on the ramp on which it stands.

    height: of its origin, m.  ramps: boxes that may be one, and their edges.
    """
    for box, size in ramps:
        up = box.rotation[:, 2]
        # A thing that has fallen over is no ramp, and a level one is not driven on.
        if not STEEP < up[2] < LEVEL:
            continue
        top = box.position + up * size[2] / 2
        foot = pose.position * (1, 1, 0)
        foot[2] = top[2] - up[:2] @ (foot - top)[:2] / up[2]
        aside = np.abs(box.rotation.T @ (foot - top))
        if foot[2] < 0 or (aside[:2] > size[:2] / 2).any():
            continue
        ahead = pose.rotation[:, 0].copy()
        ahead[2] = -up[:2] @ ahead[:2] / up[2]
        ahead /= np.sqrt(ahead @ ahead)
        return Pose(
            foot + height * up, np.column_stack([ahead, np.cross(up, ahead), up])
        )
    return pose
