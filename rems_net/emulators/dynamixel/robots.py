"""Robots that are emulated by their servos."""

from math import degrees

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.arms import BAUD, JOINTS
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.emulators.dynamixel.bus import EmulatedBus
from rems_net.emulators.dynamixel.servo import Servo
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.limb import paths
from rems_net.robots.scaler import ARMS, Scaler

XL430, XM430 = 1060, 1020


class DynabotServos(EmulatedBus):
    """A new Dynabot: two XL430-W250, and the base that they drive."""

    def __init__(self, baud: int = 1_000_000):
        kept = {table.MODEL: XL430, table.BAUD: table.BAUDS[baud]}
        self.left, self.right = (Servo(kept | {table.ID: number}) for number in (2, 1))
        super().__init__((self.left, self.right), baud)
        self.robot = combine(Dynabot, Kinematic)("emulated")
        self.robot.prepare()

    def live(self, dt: float) -> list[bytes]:
        """Let `dt` seconds pass; the base rolls on."""
        said = super().live(dt)
        # The right servo is mounted mirrored: it drives ahead clockwise.
        speeds = {"left": self.left.radians, "right": 0.0 - self.right.radians}
        top = self.robot.parameters.max_wheel_speed
        self.robot.command = {
            f"wheel/{side}": max(-top, min(top, speed))
            for side, speed in speeds.items()
        }
        self.robot.drive(self.robot.command, dt)
        return said

    def status(self) -> str:
        """Return its state in a few words."""
        state, command = self.robot.state, self.robot.command
        return (
            f"left {command['wheel/left']:.2f} rad/s, right "
            f"{command['wheel/right']:.2f} rad/s; x {state.x:.2f} m, y {state.y:.2f} "
            f"m, heading {degrees(state.heading):.0f} degrees"
        )


class ScalerServos(EmulatedBus):
    """SCALER's arms, as new, in the initial state of the definition.

    The servos are XM430-W350. A joint with two motors has two servos. The second one
    faces the first, and so counts in the other direction.
    """

    def __init__(self, baud: int = BAUD, arms: tuple[str, ...] = ARMS):
        self.joints = {p: j for p, j in JOINTS.items() if p.partition("/")[0] in arms}
        kept = {
            table.MODEL: XM430,
            table.BAUD: table.BAUDS[baud],
            table.VELOCITY_LIMIT: 200,
            table.TEMPERATURE_LIMIT: 80,
        }
        servos, begin = [], Scaler.state.schema()
        for path, joint in self.joints.items():
            at = float(joint.counts(begin[path]) % table.TURN)
            servos.append(Servo(kept | {table.ID: joint.servo}, at))
            if joint.twin:
                mounted = {table.ID: joint.twin, table.DRIVE_MODE: table.REVERSE}
                servos.append(Servo(kept | mounted, -at))
        super().__init__(servos, baud)

    def angles(self) -> dict[str, float]:
        """Return the angles of the joints, rad, by their paths."""
        at = {servo.number: servo.position for servo in self.servos}
        joints = self.joints.items()
        return {path: joint.angle(at[joint.servo]) for path, joint in joints}

    def status(self) -> str:
        """Return its state in a few words."""
        angles = self.angles()
        arms = dict.fromkeys(path.partition("/")[0] for path in angles)
        said = (
            " ".join(f"{degrees(angles[path]):.0f}" for path in paths(arm))
            for arm in arms
        )
        return f"{' and '.join(arms)} arm at {' and '.join(said)} degrees"
