"""Arms: SCALER's arms, of six joints each, by the angles of their joints."""

from collections.abc import Mapping
from math import pi
from typing import Any, NamedTuple

from rems_net.agents.ports import Settings
from rems_net.defdict import DefDict, angular_acceleration, integer
from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.bus import Said
from rems_net.drivers.hardware.dynamixel.servos import Servos
from rems_net.drivers.needs import missing

#: bits per second of the arms' servos, the same as in REMS
BAUD = 4_000_000
#: counts. Largest difference between two servos of one joint: 10 degrees, a guess.
APART = 114


class Joint(NamedTuple):
    """A joint, the servo that turns it, and how the servo counts.

    twin: a second servo with the same goal, 0 for none: joints with a high load have
        two. sign,
    offset: the servo's position is sign times (half a turn + angle + offset), rad.
    """

    servo: int
    twin: int
    sign: int
    offset: float

    def counts(self, angle: float) -> int:
        """Return the servo's goal, in counts; it may be outside of one turn."""
        return round(self.sign * (angle + self.offset + pi) / table.POSITION)

    def angle(self, counts: float, middle: float = 0.0) -> float:
        """Return the joint's angle, rad, within half a turn about `middle`."""
        raw = self.sign * counts * table.POSITION - self.offset - pi
        return (raw - middle + pi) % (2 * pi) - pi + middle


def _arm(first: int, wrist: int, signs: str, last: float) -> tuple[Joint, ...]:
    servos = [*range(first, first + 3), *range(wrist, wrist + 3)]
    twins = [*range(100 + first, 103 + first), 0, 0, 0]
    ways = [1 if sign == "+" else -1 for sign in signs]
    offsets = (0.0, pi / 2, -pi / 2, 0.0, 0.0, last)
    return tuple(map(Joint, servos, twins, ways, offsets))


ARMS = ("left", "right")
NAMES = ("shoulder", "top", "bottom", "wrist/1", "wrist/2", "wrist/3")
#: The joints, by the field that commands each; limbs 0 and 1 of the robot SCALER, as in
#: ScalerHard of REMS.
JOINTS = {
    f"{arm}/{name}": joint
    for arm, joints in {
        "left": _arm(1, 13, "+-++++", 0.0),
        "right": _arm(4, 16, "++-+-+", pi),
    }.items()
    for name, joint in zip(NAMES, joints, strict=True)
}


class Arms(Servos):
    """Driver of SCALER's arms, or one, on DYNAMIXEL servos in extended position mode.

    At speed 0, an arm's default, its joints hold their position. At the end the servos
    keep holding until their power is switched off: without torque the arm would fall.
    No joint goes faster than the Velocity Limit that is set in its servo. A servo
    measures its position within one turn: the driver takes the turn about the middle
    of the joint's range.
    """

    options = Settings(
        {
            **Servos.options.fields,
            "baud": integer(default=BAUD, range=(9600, 4_500_000), doc="bits per s"),
        },
        acceleration=angular_acceleration(
            default=17.5, range=(0.4, 1000), doc="of a joint, as in the original"
        ),
    )
    mode = table.EXTENDED_MODE
    goal = table.PROFILE_AND_GOAL
    holds = True

    def prepare(self) -> None:
        command = type(self).command.schema_for(self.parameters)
        told = {*(command.paths if command else ())}
        figures = self.parameters.schema.paths
        arms = [arm for arm in ARMS if any(path.startswith(f"{arm}/") for path in told)]
        #: the joints of the arms that the definition has
        self._mine = {p: j for p, j in JOINTS.items() if p.partition("/")[0] in arms}
        wanted = {*self._mine, *(f"{arm}/speed" for arm in arms)}
        if not arms or not wanted <= told or "joint_speed" not in figures:
            raise missing(
                self,
                "arms of six joints",
                "turning left/shoulder and five others at left/speed of its "
                "joint_speed, right/shoulder and its others, or both",
                'take the definition "scaler" or "scaler_left", or inherit from one',
            )
        self._speed = dict.fromkeys(arms, 1)
        super().prepare()

    def names(self) -> Mapping[int, str]:
        names = {}
        for path, joint in self._mine.items():
            names[joint.servo] = path
            if joint.twin:
                names[joint.twin] = f"{path}, second motor"
        return names

    def asked(self) -> list[int]:
        return [joint.servo for joint in self._mine.values()]

    def still(self, said: Said) -> int:
        return _told(1, said(table.PRESENT_POSITION))

    def found(self, said: Mapping[int, Said]) -> None:
        slope = round(self.options.acceleration / table.ACCELERATION)
        for servo in said:
            self.bus.write(servo, table.PROFILE_ACCELERATION, slope, "an acceleration")
        self._most = min(say(table.VELOCITY_LIMIT) for say in said.values())
        #: counts: position of each servo, and its whole turns ahead of its joint
        self._at = _positions(said)
        self._ahead: dict[int, int] = {}
        for path, joint in self._mine.items():
            at = self._at[joint.servo]
            angle = joint.angle(at, self._middle(path))
            self._ahead[joint.servo] = _turns(at - joint.counts(angle))
            if joint.twin:
                self._pair(joint)
        #: positions at which an arm holds; below, its last speed that was not 0
        self._held: dict[str, Mapping[int, int]] = {}
        self._speed = dict.fromkeys(self._speed, 1)

    def goals(self, command: DefDict) -> Mapping[int, int]:
        full = self.parameters.joint_speed / table.VELOCITY
        for arm in self._speed:
            if speed := command[f"{arm}/speed"]:
                self._held.pop(arm, None)
                # A Profile Velocity of 0 would mean the servo's greatest speed.
                self._speed[arm] = min(max(1, round(speed * full)), self._most)
            else:
                # Keep the first position: the arm may be pulled away afterwards.
                self._held.setdefault(arm, self._at)
        goals = {}
        for path, joint in self._mine.items():
            arm = path.partition("/")[0]
            if held := self._held.get(arm):
                at = held[joint.servo]
            else:
                at = joint.counts(command[path]) + self._ahead[joint.servo]
            goals[joint.servo] = _told(self._speed[arm], at)
            if joint.twin:
                twin = at + self._ahead[joint.twin]
                goals[joint.twin] = _told(self._speed[arm], twin)
        return goals

    def readings(self, said: Mapping[int, Said]) -> dict[str, Mapping[str, Any]]:
        self._at = _positions(said)
        state, sensors = {}, {}
        for path, joint in self._mine.items():
            arm, _, name = path.partition("/")
            state[path] = self._angle(joint, self._at[joint.servo])
            speed = joint.sign * said[joint.servo](table.PRESENT_VELOCITY)
            sensors[f"{arm}/velocity/{name}"] = speed * table.VELOCITY
        return {"state": state, "sensors": sensors}

    def _middle(self, path: str) -> float:
        """Return the middle of a joint's range, rad."""
        low, high = getattr(self.command.schema[path], "range", None) or (0.0, 0.0)
        return float(low + high) / 2

    def _angle(self, joint: Joint, counts: int) -> float:
        """Return a joint's angle, rad, with turns counted since the servo was found."""
        at = (counts - self._ahead[joint.servo]) * table.POSITION
        return joint.sign * at - joint.offset - pi

    def _pair(self, joint: Joint) -> None:
        """Check that a joint's two servos agree, apart from whole turns."""
        apart = self._at[joint.twin] - self._at[joint.servo]
        self._ahead[joint.twin] = _turns(apart)
        left = abs(apart - _turns(apart))
        if left > APART:
            raise NoDeviceError(
                f"{self.bus.name(joint.servo)} and servo {joint.twin} turn the same "
                f"joint, and are {left * 360 / table.TURN:.0f} degrees apart: they "
                "would pull against each other. Check, in this order: 1. how their "
                "horns are mounted; 2. that one of them counts in reverse, with "
                "DYNAMIXEL Wizard: Drive Mode; 3. its Homing Offset."
            )


def _positions(said: Mapping[int, Said]) -> dict[int, int]:
    return {servo: say(table.PRESENT_POSITION) for servo, say in said.items()}


def _told(speed: int, position: int) -> int:
    """Return the value of PROFILE_AND_GOAL, in counts."""
    first = table.PROFILE_VELOCITY.pack(speed)
    return table.PROFILE_AND_GOAL.unpack(first + table.GOAL_POSITION.pack(position))


def _turns(counts: int) -> int:
    """Return the whole turns nearest to `counts`, in counts."""
    return round(counts / table.TURN) * table.TURN
