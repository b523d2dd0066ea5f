"""Draft: a definition that is written for the user, from their robot's file."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib.util import find_spec
from math import ceil, floor, pi
from pathlib import Path

import numpy as np

from rems_net.bodies.body import GRAVITY
from rems_net.bodies.files import writing
from rems_net.bodies.files.built import MUJOCO, read
from rems_net.bodies.files.sheet import Moved, Sheet
from rems_net.bodies.model import Model
from rems_net.errors import SchemaError, some

#: N m or N; rad/s or m/s. A larger value in a file is a placeholder, not a limit.
MOST_EFFORT, MOST_SPEED = 1000.0, 50.0
#: Guesses if a file has no value: rad/s and m/s; N m and N per N of the robot's weight.
TURNING, SLIDING, LEVER, PUSH = 1.0, 0.1, 0.3, 1.0
#: Loss of speed of a motor at full effort, as a share of its speed; and s: the time in
#: which full effort changes the speed by that loss, one step of the physics.
DROOP, STEP = 0.1, 0.001
#: Least loss of speed, as a share. With less, a brake makes the motor chatter.
LEAST = 0.01
#: 1/s. Gain of a servo if the file has none; least and most gain taken from a file.
GAIN, SLACK, STIFF = 20.0, 1.0, 100.0
#: m. A wheel's lowest point is at most this much above the robot's lowest point.
NEAR = 0.01
#: Offset of a wheel's middle from its axle, at most, as a share of its size.
OFF = 0.1
#: A link with this word in its name is a caster: no friction, since it cannot swivel.
CASTER = "caster"
#: rad and m: first movement of a joint in the drafted program; its share of the speed.
FAR, SHORT, SLOWLY = 0.5, 0.05, 0.3
#: Field names that a joint cannot have: the definition uses them itself.
TAKEN = {"x", "y", "heading", "speed"}
#: Letters of a field's name, at most.
LONGEST = 60
GUESS = "  # a guess: the file has none"
HIGH = "  # nothing of it meets the floor there"


def drafted(file: Path, packages: str = "", root: str = "") -> dict[str, str]:
    """Return the text of each placeholder of `templates/model.txt` for a robot's file.

    packages, root: as of a `Model`      Raises SchemaError if no joint moves.
    """
    folder = Path(packages).absolute() if packages else None
    plain = Model(file.absolute(), fixed=True, root=root, packages=folder)
    sheet = read(replace(plain, mend=True))
    try:
        read(plain)
        mend = False
    except SchemaError:
        mend = True
    if not sheet.joints:
        raise SchemaError(
            f"{file.name} has no joint that moves, so a command "
            "would move nothing. (R0212)"
        )
    return _Draft(sheet, mend, packages, root).words()


class _Joint:
    """One joint, with the values that the definition writes for it."""

    def __init__(self, moved: Moved, path: str, weight: float, wheel: bool):
        self.moved, self.wheel, turns = moved, wheel, moved.turns
        self.path = path
        self.guessed = not 0 < moved.effort <= MOST_EFFORT
        guess = weight * (LEVER if turns else PUSH)
        self.effort = writing.brief(guess) if self.guessed else moved.effort
        guess = TURNING if turns else SLIDING
        self.hurried = not 0 < moved.speed <= MOST_SPEED
        self.speed = guess if self.hurried else moved.speed
        droop = self.effort / moved.brake if moved.brake else DROOP * self.speed
        self.droop = writing.brief(min(max(droop, LEAST * self.speed), self.speed))
        self.gain = (
            writing.brief(min(max(moved.gain, SLACK), STIFF)) if moved.gain else GAIN
        )
        low, high = moved.limits or (-pi, pi)
        if moved.asked and max(low, moved.asked[0]) < min(high, moved.asked[1]):
            low, high = max(low, moved.asked[0]), min(high, moved.asked[1])
        self.low, self.high = ceil(low * 1e4) / 1e4, floor(high * 1e4) / 1e4
        inside = self.low <= 0 <= self.high
        self.start = 0.0 if inside else round((self.low + self.high) / 2, 3)

    def field(self, begins: bool) -> tuple[str, str]:
        """Return the kind of the joint's field, and its arguments in the command."""
        kind = "angle" if self.moved.turns else "length"
        if self.wheel:
            return "angular_velocity", f"range=(-{self.speed:g}, {self.speed:g})"
        more = f", default={self.start:g}" if begins and self.start else ""
        return kind, f"range=({self.low:g}, {self.high:g}){more}"

    @property
    def top(self) -> str:
        """Line of the parameter that is the joint's speed at share 1."""
        kind = "angular_velocity" if self.moved.turns else "velocity"
        most = MOST_SPEED if self.hurried else self.speed
        ends = f"range=({LEAST * self.speed:g}, {most:g})"
        return f'"{self.path}": {kind}(default={self.speed:g}, {ends}),'

    def driven(self) -> list[str]:
        """Return the arguments of the joint's `Driven`, as source text."""
        servo = f'gain={self.gain:g}, speed=top["{self.path}"], share="speed"'
        told = [writing.text(self.moved.name), f"droop={self.droop:g}"]
        if self.guessed:
            told.append(f"effort={self.effort:g}{GUESS}")
        if not self.moved.armature:
            told.append(f"armature={writing.brief(self.effort * STEP / self.droop):g}")
        if self.path != self.moved.name:
            told.append(f'command="{self.path}"')
        if not self.wheel:
            told.append(f"servo=Servo({servo})")
            told.append(f'position="{self.path}"')
        return told

    def first(self) -> str:
        """Return its first command as source text; in that, `go` is 1, later 0."""
        if self.wheel:
            return f"{writing.brief(SLOWLY * self.speed):g} * go"
        far = FAR if self.moved.turns else SHORT
        up, down = self.high - self.start, self.start - self.low
        far = round(min(far, up / 2) if up >= down else -min(far, down / 2), 3)
        return f"{self.start:g} + {far:g} * go" if self.start else f"{far:g} * go"


class _Draft:
    def __init__(self, sheet: Sheet, mend: bool, packages: str, root: str):
        self._sheet, self._mend = sheet, mend
        self._packages, self._root = packages, root
        masses = (joint.solid.mass for joint in sheet.joints)
        weight = -GRAVITY * (sheet.base.mass + sum(masses))
        wheels = set() if sheet.bolted else {*_wheels(sheet)}
        # A URDF does not state it; a robot without wheels is most often an arm.
        self._fixed = sheet.bolted or not (wheels or sheet.height is not None)
        told = [one for one in sheet.joints if one.follows is None]
        self._joints = [
            _Joint(one, path, weight, one.name in wheels)
            for one, path in zip(told, _paths(one.name for one in told), strict=True)
        ]

    def words(self) -> dict[str, str]:
        """Return the text of each placeholder of the template."""
        joints, servos = self._joints, [one for one in self._joints if not one.wheel]
        fields = ((one.path, *one.field(True)) for one in joints)
        commands = [f'"{path}": {kind}({told}),' for path, kind, told in fields]
        pose = '"x": length(),\n"y": length(),\n"heading": angle(),'.splitlines()
        states = [] if self._fixed else pose
        for one in servos:
            kind, _ = one.field(True)
            start = f"default={one.start:g}" if one.start else ""
            states.append(f'"{one.path}": {kind}({start}),')
        hand = [f'"{one.path}": {one.first()},' for one in joints]
        if servos:
            commands.append('"speed": ratio(range=(0, 1)),')
            hand.append(f'"speed": {SLOWLY},')
        tops = [one.top for one in servos]
        lines = "".join(commands + states + tops)
        kinds = {*re.findall(r'": (\w+)\(', lines)}
        mathematics = self._fixed and bool(servos)
        return {
            "imports": "\n".join(self._imports(kinds, bool(servos), mathematics)),
            "settings": ", Settings" if servos else "",
            "parameters": _parameters(tops) if servos else "",
            "top": '        top = self.parameters["top_speed"]\n' if servos else "",
            "summary": self._summary(bool(servos)),
            "command": writing.lines(16, commands),
            "state": writing.lines(16, states),
            "advance": _ADVANCE if mathematics else "",
            "joints": "\n".join(
                writing.wrapped("Driven", one.driven(), 12, ",") for one in joints
            ),
            "model": self._model(),
            "hand": writing.lines(12, hand),
            "path": writing.path(self._sheet.path),
            "guesses": "\n".join(self._guesses()),
            "file": re.sub(r'["\\\\]', "_", self._sheet.name),
            "driver": MUJOCO
            if find_spec(MUJOCO) or not self._sheet.urdf
            else "pybullet",
        }

    def _guesses(self) -> Iterator[str]:
        """Yield one line for each value that the file leaves open."""
        if self._sheet.urdf and not self._sheet.bolted:
            yield "it is bolted down" if self._fixed else "it stands on the floor"
        for what, joints in (
            ("wheels", [one.path for one in self._joints if one.wheel]),
            ("effort of", [one.path for one in self._joints if one.guessed]),
            ("speed of", [one.path for one in self._joints if one.hurried]),
            ("what slips", self._casters()),
        ):
            if joints:
                yield f"{what}: {some(joints, 4)}"

    def _casters(self) -> list[str]:
        if self._fixed:
            return []
        return [name for name in self._sheet.links if CASTER in name.lower()]

    def _imports(
        self, kinds: Iterable[str], servos: bool, mathematics: bool
    ) -> Iterator[str]:
        more = ", Servo" * servos + ", toward" * mathematics
        yield f"from rems_net.bodies import Driven, Model{more}"
        yield f"from rems_net.units import {', '.join(sorted(kinds))}"

    def _summary(self, servos: bool) -> str:
        if not servos:
            return "Its wheels turn at the commanded speeds."
        also = "" if all(not one.wheel for one in self._joints) else ", its wheels, too"
        return f"Its joints go to their commands, at a share of their speed{also}."

    def _model(self) -> str:
        told = ["FILE", "joints"]
        if self._fixed:
            told += ["fixed=True", f"height={self._sheet.reach:g}{HIGH}"]
        if casters := self._casters():
            slip = ", ".join(f"{writing.text(name)}: 0.0" for name in casters)
            told.append(f"friction={{{slip}}}")
        if self._mend:
            told.append("mend=True")
        if self._root:
            told.append(f"root={writing.text(self._root)}")
        if self._packages:
            told.append(f"packages=FILE.parent / {writing.path(Path(self._packages))}")
        return writing.wrapped("return Model", told, 8)


_ADVANCE = """
    def advance(self, state, command, dt):  # where its joints are dt seconds later
        share = command["speed"] * dt
        return {
            name: toward(state[name], command[name], share * speed)
            for name, speed in self.parameters["top_speed"].items()
        }
"""


def _wheels(sheet: Sheet) -> Iterator[str]:
    """Yield the names of endless hinges whose link is round and touches the floor."""
    for joint, at in zip(sheet.joints, sheet.places, strict=True):
        if not joint.turns or joint.limits is not None:
            continue
        for middle, size in joint.solid.boxes:
            off = middle - np.dot(middle, joint.axis) * np.array(joint.axis)
            on_floor = at[2] + middle[2] - size[2] / 2 < sheet.low + NEAR
            if on_floor and float(np.abs(off).max()) < OFF * float(size.max()):
                yield joint.name
                break


def _parameters(tops: Iterable[str]) -> str:
    """Return the parameters' source: each joint's speed, which experiments can set."""
    head = '\n    parameters = Settings(\n        {\n            "top_speed": {'
    return f"{head}\n{writing.lines(16, tops)}\n            }}\n        }}\n    )"


def _paths(names: Iterable[str]) -> Iterator[str]:
    """Yield a field name for each joint's name, all different."""
    taken = {*TAKEN}
    for name in names:
        path = re.sub(r"[^\w.-]+", "_", name)[:LONGEST]
        if path in taken:
            path = f"{path}_joint"
        while path in taken:
            path = f"{path}_2"
        taken.add(path)
        yield path
