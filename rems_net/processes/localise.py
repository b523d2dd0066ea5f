"""Localise: the poses of robots, from their markers in a camera's pictures."""

from typing import Any

import numpy as np

from rems_net.agents.agent import Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.bodies.lens import Lens
from rems_net.bodies.parts import Array
from rems_net.defdict import (
    Field,
    Schema,
    angle,
    array,
    integer,
    length,
    many,
    text,
    time,
)
from rems_net.errors import SchemaError, nearest
from rems_net.events import warn
from rems_net.eyes.finder import Finder, Found, Target, mirrored
from rems_net.eyes.known import Known
from rems_net.eyes.view import View, turn_of
from rems_net.kinematics.rotation import wrapped
from rems_net.libraries import look_for
from rems_net.maths import hypot
from rems_net.scenes import marking

#: m. A pose that is further from the last one comes with a warning.
JUMP = 0.1
#: s. A picture that is older is reported: the camera is frozen, or covered.
FROZEN = 0.5
#: s. A marker that was not seen for this long is reported.
LOST = 1.0
#: pictures without any marker, before it is tested whether they are mirrored
EMPTY = 20

_POSE: dict[str, Field] = {
    "id": integer(doc="of its marker; -1 before it was seen"),
    "x": length("m", doc="of the robot, not of its marker"),
    "y": length("m", doc="of the robot, not of its marker"),
    "heading": angle("rad", doc="counter-clockwise from +x, on past a full turn"),
    "covariance": array((3, 3), doc="of x, y and heading: m2, m rad, rad2"),
    "tick": integer(doc="of the picture"),
    "age": time("s", doc="of the picture, at the end of this step"),
}
POSE = Schema("localise.pose", {**_POSE, "id": integer(default=-1)})
POSES = Schema(
    "localise.poses",
    {"seen": many(Schema("localise.seen", {"robot": text(), **_POSE}), max_len=100)},
)
#: a marker that is looked for besides those of robots, and one at a known place
OTHER = Schema("localise.marker", {"name": text(), **marking.MARKER.entries})
KNOWN = Schema("localise.known", {**marking.MARKER.entries})


class Localise(Process):
    """Finds robots by the markers on them, in the pictures of one camera.

    Its value at `process/<name>/poses` is a list; each robot that the option `robots`
    names has its newest pose at `process/<name>/<robot>`, too. Markers lie level, at
    known heights: see the page eyes.
    """

    options = Settings(
        robots=text(doc="names with commas; each has a port of its own"),
        markers=many(OTHER, max_len=100, doc="besides those that robots state"),
        known=many(KNOWN, max_len=50, doc="at known places: they place the camera"),
    )
    needs = ("apriltag",)
    by_picture = True
    camera = In()
    markers = In(source="robot/*/marker")
    poses = Out(POSES)
    _finder: Finder | None = None

    def prepare(self) -> None:
        """Give each named robot a port."""
        super().prepare()
        look_for("apriltag", "camera")
        taken = {*dir(self)}
        for name in self._names():
            if name in taken or not name.isidentifier():
                raise SchemaError(
                    f"robots names {name!r}, which is no name of a robot, or that of "
                    'something else here; write such as robots = "bot, cart". (R1104)'
                )
            self.settle(name, POSE)
        self._known = Known([marking.read(one) for one in self.options["known"]])

    def schemas(self) -> dict[str, Schema]:
        """Return the schemas of all ports, with one for each named robot."""
        return {**super().schemas(), **dict.fromkeys(self._names(), POSE)}

    def published(self) -> dict[str, Schema]:
        return {**super().published(), **dict.fromkeys(self._names(), POSE)}

    def _names(self) -> list[str]:
        names = (name.strip() for name in self.options["robots"].split(","))
        return [name for name in names if name]

    def open(self) -> None:
        """Start without any pose. Raises SchemaError for what is no camera."""
        if "lens" not in self.camera:
            raise SchemaError(
                f"camera is connected to {self.camera.schema.name}, which has no "
                "picture; connect it to such as 'robot/cam/sensors'. (R1104)"
            )
        self._finder = None
        self._latest: dict[str, tuple[Array, Array, int, int]] = {}
        self._warned: set[tuple[str, int]] = set()
        self._stated: set[str] | None = None
        self._picture, self._empty = -1, 0

    def step(self, tick: Tick) -> None:
        """Find the robots in a new picture."""
        seen: Any = self.camera
        if not seen["lens/fx"]:
            return  # nothing has come from a real camera yet
        shot = int(seen["tick"])
        # A pose is as old as its picture.
        runtime(self).source_ticks["camera"] = shot
        age = (tick.n - shot) * runtime(self).dt
        self._doubt(tick, "frozen", -1, _FROZEN.format(age) if age > FROZEN else "")
        if shot != self._picture:
            self._picture = shot
            self._look(tick, seen, age)
        elif age <= FROZEN:
            self._publish(tick)

    def _look(self, tick: Tick, seen: Any, age: float) -> None:
        finder = self._finder = self._finder or self._begin(seen)
        if self._stated != {*self.markers}:
            self._meet(tick, finder)
        # Markers are black and white: green alone is as good as all three, and faster.
        grey = np.ascontiguousarray(seen["picture"][:, :, 1])
        found, doubts = finder.look(grey)
        if self._known.markers:
            sentence = self._known.place(finder)
            if sentence:
                warn("placed", f"{self.key}: {sentence}", self.key, tick.n)
                found, doubts = finder.place()
        for kind, number, sentence in doubts:
            self._doubt(tick, kind, number, f"marker {number} {sentence}")
        for one in found:
            if one.target.name:
                self._take(tick, one)
        self._miss(tick, grey, finder)
        self._publish(tick)

    def _begin(self, seen: Any) -> Finder:
        lens, place = seen["lens"], seen["place"]
        height, width, _ = seen["picture"].shape
        four = {name: lens[name] for name in ("fx", "fy", "cx", "cy")}
        made = Lens(width, height, **four, bends=tuple(lens["bends"].tolist()))
        turn = turn_of(place["heading"], place["pitch"], place["roll"])
        eye = np.array([place["x"], place["y"], place["z"]])
        self._first = self._picture
        return Finder(View.at(made, eye, turn), self._targets())

    def _meet(self, tick: Tick, finder: Finder) -> None:
        """Look for robots that came, and warn of those that cannot be found."""
        first, self._stated = self._stated is None, {*self.markers}
        try:
            finder.targets = self._targets()
        except SchemaError as error:
            if first:
                raise
            # A newcomer ends nothing: those that were there are found on.
            warn("twice", f"{self.key}: {error}", self.key, tick.n)
        marked = sorted({one.name for one in finder.targets.values()} - {""})
        for name in self._names():
            if name not in marked:
                sentence = (
                    f"robots names {name!r}, which has no marker; there is "
                    f"{', '.join(marked) or 'none'}.{nearest(name, marked)}"
                )
                warn("unknown", f"{self.key}: {sentence}", self.key, tick.n)

    def _targets(self) -> dict[int, Target]:
        stated: Any = self.markers
        values = [(key.split("/")[1], one) for key, one in stated.items()]
        values += [(one["name"], one) for one in self.options["markers"]]
        targets: dict[int, Target] = {}
        for name, value in values:
            marker = marking.read(value, value["height"])
            other = targets.setdefault(marker.id, Target(name, marker, value["height"]))
            if other.name != name:
                raise SchemaError(
                    f"{other.name} and {name} both have marker {marker.id}; give one "
                    "of them another id. (R1105)"
                )
        targets |= {
            one.id: Target("", one, one.at[2])
            for one in self._known.markers
            if one.id not in targets
        }
        return targets

    def _take(self, tick: Tick, one: Found) -> None:
        """Keep a robot's pose; its heading goes on past a full turn."""
        name, pose = one.target.name, one.pose
        before = self._latest.get(name)
        if before is not None:
            last, _, _, at = before
            pose[2] = last[2] + wrapped(pose[2] - last[2])
            far = float(hypot(*(pose[:2] - last[:2]).tolist()))
            if far > JUMP:
                warn(
                    "jump",
                    f"{self.key}: {name} was {1e3 * far:.0f} mm away "
                    f"{(self._picture - at) * runtime(self).dt:.2f} s before: it was "
                    "moved by hand, or was out of sight",
                    self.key,
                    tick.n,
                )
        number = one.target.marker.id
        self._latest[name] = pose, one.covariance, number, self._picture
        self._doubt(tick, "lost", number, "")

    def _miss(self, tick: Tick, grey: Any, finder: Finder) -> None:
        """Warn of robots out of sight, and of a picture that is mirrored."""
        for number, target in finder.targets.items():
            name, latest = target.name, self._latest.get(target.name)
            gone = self._picture - (latest[3] if latest else self._first)
            seconds = gone * runtime(self).dt
            if name and seconds > LOST and (latest or finder.seen):
                sentence = (
                    f"{name} is out of sight for {seconds:.1f} s: its marker {number} "
                    "is covered, dirty, upside down, or outside of the picture"
                )
                self._doubt(tick, "lost", number, sentence)
        self._empty = 0 if finder.seen else self._empty + 1
        if self._empty == EMPTY and not self._latest:
            families = {one.marker.family for one in finder.targets.values()}
            told = _MIRROR if families and mirrored(grey, families) else _NOTHING
            self._doubt(tick, "nothing", -1, told)

    def _publish(self, tick: Tick) -> None:
        dt, rows = runtime(self).dt, []
        names = self._names()
        for name, (pose, covariance, number, at) in sorted(self._latest.items()):
            row = {
                "id": number,
                "x": float(pose[0]),
                "y": float(pose[1]),
                "heading": float(pose[2]),
                "covariance": covariance,
                "tick": at,
                "age": (tick.n - at) * dt,
            }
            rows.append({"robot": name, **row})
            if name in names:
                self.__dict__[name].update(row)
        self.poses = {"seen": rows}

    def _doubt(self, tick: Tick, kind: str, number: int, sentence: str) -> None:
        """Warn of a doubt once, and again after it was over; "" ends it."""
        key = (kind, number)
        if not sentence:
            self._warned.discard(key)
        elif key not in self._warned:
            self._warned.add(key)
            warn(kind, f"{self.key}: {sentence}", self.key, tick.n)


_FROZEN = "the newest picture is {:.1f} s old: the camera is frozen, and poses age"
_MIRROR = (
    "the pictures are mirrored, so no marker is found: switch the camera's mirror off"
)
_NOTHING = (
    "no marker is in the pictures: are they printed with a white rim, sharp, and of "
    "the family that is written, and, in a simulation, in the camera's world?"
)
