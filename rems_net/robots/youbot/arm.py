"""KUKA's arm of five joints, and its gripper."""

from math import pi, radians
from typing import Any, ClassVar

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.agents.verbs import verb
from rems_net.bodies.body import Body, Vector
from rems_net.bodies.devices import Devices, Motor, Reading
from rems_net.bodies.noise import Noise
from rems_net.defdict import DefDict, Schema, angle, angular_velocity, length, ratio
from rems_net.kinematics.arm import Mechanism
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.servo import speed_toward, toward
from rems_net.kinematics.upright import Proportions, UprightArm
from rems_net.robots.youbot.body import FINGER_SPEED, FINGER_TRAVEL, arm

#: paths of the arm's joints, from the foot to the hand
JOINTS = tuple(f"arm/joint/{number}" for number in range(1, 6))
#: degrees. The joints' stops from upright, positive ahead (and counter-clockwise):
#: KUKA's data sheet; its URDF has the same, counted from folded.
STOPS = ((-169, 169), (-65, 90), (-151, 146), (-102.5, 102.5), (-167.5, 167.5))
#: turns of the arm's motors per turn of the joints: KUKA's driver
GEAR_RATIOS = (156.0, 156.0, 100.0, 71.0, 71.0)
#: m. KUKA's Denavit-Hartenberg parameters: upright, the tool is 0.6545 m high. The
#: fifth joint's place on the fourth link (0.130) is the URDF's.
PROPORTIONS = Proportions(
    height=0.147, ahead=0.033, upper=0.155, lower=0.135, wrist=0.130, tool=0.0875
)


class YoubotArm(Definition):
    """An arm of five joints and a gripper.

    Frame: the origin is where the first axis meets the plate under the arm; x ahead, y
    left, z up. At zero the arm is upright. Positive angles lean it ahead, and turn
    foot and hand counter-clockwise seen from above.

    The command has the joints' target angles and their speed. At speed 0, the default,
    the joints hold their positions.
    """

    integrator = "euler"  # as the class's model
    #: m. Position of the foot in the robot's frame.
    foot: ClassVar[Vector] = (0.0, 0.0, 0.0)

    parameters = Settings(
        joint_speed=angular_velocity(
            default=1.5708, range=(0.001, 100), doc="of a joint at speed 1; URDF"
        ),
    )

    command = In(
        Schema(
            "youbot_arm.command",
            {
                **{
                    path: angle(range=(radians(low), radians(high)), doc="to go to")
                    for path, (low, high) in zip(JOINTS, STOPS, strict=True)
                },
                "arm/gripper": length(
                    range=(0, FINGER_TRAVEL), doc="of each finger from closed"
                ),
                "arm/speed": ratio(
                    range=(0, 1), doc="how fast to go there; at 0 all joints hold"
                ),
            },
        )
    )
    state = Out(
        Schema(
            "youbot_arm.state",
            {
                **dict.fromkeys(JOINTS, angle(doc="from upright")),
                "arm/gripper": length(doc="of each finger from closed"),
            },
        )
    )
    sensors = Out(
        Schema(
            "youbot_arm.sensors",
            {path.replace("joint", "velocity"): angular_velocity() for path in JOINTS},
        )
    )

    def advance(self, state: DefDict, command: DefDict, dt: float) -> dict[str, Any]:
        """Return the positions of joints and fingers `dt` seconds later."""
        share = command["arm/speed"]
        most = share * self.parameters.joint_speed * dt
        gone = {path: toward(state[path], command[path], most) for path in JOINTS}
        gone["arm/gripper"] = toward(
            state["arm/gripper"], command["arm/gripper"], share * FINGER_SPEED * dt
        )
        return gone

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return the joints' speeds."""
        speed = command["arm/speed"] * self.parameters.joint_speed
        return {
            path.replace("joint", "velocity"): speed_toward(
                state[path], command[path], speed
            )
            for path in JOINTS
        }

    def mechanisms(self) -> dict[str, Mechanism]:
        """Return the kinematics of the arm."""
        return {"arm": self._chain()}

    def _chain(self) -> UprightArm:
        limits = [(radians(low), radians(high)) for low, high in STOPS]
        return UprightArm(JOINTS, limits, PROPORTIONS, Pose.of(self.foot))

    def noise(self) -> dict[str, Noise]:
        """Return the noise of the sensors.

        KUKA's driver reads a motor's speed, before the gears, in whole revolutions per
        minute.
        """
        return {
            path.replace("joint", "velocity"): Noise(step=2 * pi / 60 / gear)
            for path, gear in zip(JOINTS, GEAR_RATIOS, strict=True)
        }

    @verb
    def tool(self) -> dict[str, float]:
        """Return the tool's pose in the robot's frame: x, y, z in m, and rpy in rad."""
        told: dict[str, float] = self.fk(of="arm").told()
        return told

    def body(self) -> Body:
        """Return the arm's body; without a base it is bolted to the floor."""
        return arm(self._chain(), self.parameters.joint_speed)

    def webots(self) -> Devices:
        """Return the joints' names in Webots' Youbot.

        There a positive angle leans the arm back, and ahead it leans at most 65 deg.
        """
        signs = dict(zip(JOINTS, (1.0, -1.0, -1.0, -1.0, 1.0), strict=True))
        top, pace = self.parameters.joint_speed, "arm/speed"
        joints = [(path, f"arm{path[-1]}", sign) for path, sign in signs.items()]
        return Devices(
            motors=(
                *(Motor(d, path, sign, 0.0, pace, top) for path, d, sign in joints),
                # Coupled to the right finger in Webots' model.
                Motor("finger::left", "arm/gripper", pace=pace, top=FINGER_SPEED),
            ),
            readings=tuple(
                Reading(path, f"{device}sensor", factor=sign, port="state")
                for path, device, sign in joints
            ),
        )
