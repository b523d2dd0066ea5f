"""Actor: a robot or a thing of a recording, and where it was at any time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rems_net.bodies.parts import Array
from rems_net.films.model import Scene
from rems_net.kinematics.pose import Pose
from rems_net.recordings.comparison import unit_factor
from rems_net.recordings.csv_file import named
from rems_net.recordings.recording import Recording
from rems_net.recordings.table import Columns

#: m or rad. A larger value is not drawn: the robot has run away.
FAR = 1e6


class Curves:
    """The values of one port over time.

    prefix: of its columns, such as "state/".
    """

    def __init__(self, columns: Columns, prefix: str):
        #: s
        self.times = columns.seconds()
        self._columns, self._prefix = columns, prefix
        self._read: dict[str, Array | None] = {}

    def at(self, now: float, path: str, unit: str) -> float | None:
        """Return a value in a unit at a time [s]; None if none was recorded."""
        if path not in self._read:
            self._read[path] = self._curve(self._prefix + path, unit)
        curve = self._read[path]
        return None if curve is None else float(np.interp(now, self.times, curve))

    def _curve(self, name: str, unit: str) -> Array | None:
        if name not in self._columns:
            return None
        values = self._columns.plain(name)
        factor = 1.0 if not unit else unit_factor(self._columns.unit(name), unit)
        if factor is None or values.dtype.kind not in "fib":
            return None
        curve = factor * values.astype(float)
        kept = np.isfinite(curve) & (np.abs(curve) < FAR)
        if not kept.any():
            return None
        if name.endswith(("heading", "pitch", "roll")):
            curve[kept] = np.unwrap(curve[kept])
        return np.asarray(np.interp(self.times, self.times[kept], curve[kept]))


@dataclass(frozen=True)
class Actor:
    """A robot or a thing: its key, its scene and its values.

    curves: None if nothing was recorded of it
    """

    key: str
    scene: Scene
    curves: Curves | None

    def read(self, now: float, path: str, unit: str) -> float | None:
        """Return a recorded value at a time [s]; None if there is none."""
        return None if self.curves is None else self.curves.at(now, path, unit)

    @property
    def is_ghost(self) -> bool:
        """Whether it is a ghost, which stands where a robot on another fabric is."""
        return bool(self.scene.get("ghost"))

    def is_there(self, now: float) -> bool:
        """Return whether it is there at a time; a ghost may be gone."""
        return not self.is_ghost or bool(self.read(now, "there", ""))

    def stands(self, now: float) -> bool:
        """Return whether nothing but the floor gives it its height."""
        return "place" not in self.scene and self.read(now, "z", "m") is None

    def pose(self, now: float) -> Pose | None:
        """Return its pose at a time [s]; None if it is nowhere."""
        x, y, z = self.scene.get("at") or (None, None, self.scene.get("height", 0.0))
        heading = self.scene.get("heading", 0.0)
        if "place" in self.scene:  # it is bolted down
            x, y, heading = self.scene["place"]
        x, y = self._or(now, "x", "m", x), self._or(now, "y", "m", y)
        if x is None or y is None:
            return None
        angles = {
            word: self._or(now, word, "rad", self.scene.get(word, 0.0)) or 0.0
            for word in ("pitch", "roll")
        }
        return Pose.of(
            (x, y, self._or(now, "z", "m", z) or 0.0),
            yaw=self._or(now, "heading", "rad", heading) or 0.0,
            pitch=-angles["pitch"],  # ours lifts the nose
            roll=angles["roll"],
        )

    def _or(
        self, now: float, path: str, unit: str, other: float | None
    ) -> float | None:
        value = self.read(now, path, unit)
        return other if value is None else value


def actors(recording: Recording, scenes: Mapping[str, Scene]) -> Iterator[Actor]:
    """Yield the robots that have a pose, and the things of all worlds."""
    there = {*recording}
    for key, scene in scenes.items():
        columns = recording[named(key)] if named(key) in there else None
        if columns is not None and not len(columns.seconds()):
            columns = None
        if key.startswith("robot/") and columns is not None:
            robot = Actor(key, scene, Curves(columns, "state/"))
            if robot.pose(0.0) is not None:
                yield robot
        for thing in scene.get("things", ()):
            prefix = f"{thing['name']}/pose/"
            curves = None if columns is None else Curves(columns, prefix)
            yield Actor(f"{key}/{thing['name']}", thing, curves)
