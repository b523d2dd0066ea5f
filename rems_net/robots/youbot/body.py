"""The youBot's body: a box on wheels with rollers, an arm and a gripper.

Values without a source are guesses: shapes of links, which are plain cylinders here,
droop and gain of the motors' control, the inertia of their gears.
"""

from collections.abc import Sequence

from rems_net.bodies.body import (
    Body,
    Box,
    Cylinder,
    Hinge,
    Joint,
    Part,
    Servo,
    Slide,
    Tachometer,
)
from rems_net.kinematics.upright import UprightArm

#: The base: size of its box, and the box's middle above the axles, m; mass with the
#: wheels, kg; all from the URDF.
CHASSIS, CHASSIS_AT, BASE_MASS = (0.57, 0.36, 0.10), (0.0, 0.0, 0.03), 22.0
#: kg, URDF, and m, a guess, of a wheel
WHEEL_MASS, WHEEL_WIDTH = 0.4, 0.05
#: N m, and Coulomb's coefficient of the rollers; both are guesses
WHEEL_TORQUE, WHEEL_FRICTION = 2.0, 0.8
#: x and y of the axis of a roller that touches the floor: it lies between the two axes
SLANT = 0.5**0.5
#: droop, rad/s at full torque, and gain, 1/s: guesses
DROOP, GAIN = 0.06, 20.0
#: Inertia of motors and gears, kg m2, of a wheel and of the arm's joints: a guess, from
#: flat motors of that size (1.4e-5 and less) and the gears' 26, 156, 156, 100, 71, 71.
GEARS, ARMATURES = 0.01, (0.33, 0.33, 0.135, 0.046, 0.018)
#: N m. Torques of the arm's motors: URDF.
TORQUES = (9.5, 9.5, 6.0, 2.0, 1.0)
#: kg, of the foot and of the links that the five joints move: the maker's data for
#: aluminium arms, as in the URDF of the mas-group.
FOOT_MASS, LINK_MASSES = 0.961, (1.390, 1.318, 0.821, 0.769, 0.687)
#: m. Radii of the links, and height of the foot under the first joint: guesses.
RADII, STAND = (0.06, 0.04, 0.035, 0.03, 0.025), 0.05
#: m and m/s. Travel and speed of each finger: URDF.
FINGER_TRAVEL, FINGER_SPEED = 0.0115, 0.1
#: A finger: its position on the hand while closed, m (URDF), its size, its mass, kg,
#: and its force, N (URDF); the inertia of its motor, as kg, is a guess.
FINGER_AT, FINGER = (0.0, 0.008, 0.046), (0.014, 0.012, 0.0415)
FINGER_MASS, FINGER_FORCE, FINGER_MOTOR = 0.01, 1.0, 0.1
SHARE = "arm/speed"


def base(paths: Sequence[str], radius: float, wheelbase: float, track: float) -> Body:
    """Return the base. Seen from above, the rollers on top of its wheels make an X.

    paths: of the wheels' fields: front left, front right, rear left, rear right
    """
    tyre = Cylinder(radius, WHEEL_WIDTH, axis=(0.0, 1.0, 0.0))
    x, y = wheelbase / 2, track / 2
    # Seen from above, the rollers on the floor make an O.
    corners = ((x, y, -SLANT), (x, -y, SLANT), (-x, y, SLANT), (-x, -y, -SLANT))
    wheels = [
        Hinge(
            path,
            (Part(tyre, WHEEL_MASS, friction=WHEEL_FRICTION),),
            at=(ahead, aside, 0.0),
            axis=(0.0, 1.0, 0.0),
            torque=WHEEL_TORQUE,
            droop=DROOP,
            armature=GEARS,
            position=path,
            rollers=(SLANT, slant, 0.0),
        )
        for path, (ahead, aside, slant) in zip(paths, corners, strict=True)
    ]
    chassis = Part(Box(CHASSIS), BASE_MASS - len(wheels) * WHEEL_MASS, CHASSIS_AT)
    return Body((chassis,), tuple(wheels), height=radius)


def arm(chain: UprightArm, speed: float) -> Body:
    """Return the arm of this chain, bolted to the floor.

    speed: of the joints, rad/s
    """
    size, (x, y, z) = chain.size, chain.base.position.tolist()
    # Each link reaches to the next joint, the last one to the fingers.
    lengths = (size.height, size.upper, size.lower, size.wrist, FINGER_AT[2])
    carried: tuple[Joint, ...] = (_finger("left", 1.0), _finger("right", -1.0))
    for n, one in reversed([*enumerate(chain.links)]):
        begin = 0.0 if n else STAND
        link = Cylinder(RADII[n], lengths[n] - begin)
        middle = (0.0, 0.0, (lengths[n] + begin) / 2)
        joint = Hinge(
            one.name,
            (Part(link, LINK_MASSES[n], middle),),
            at=one.at if n else (x, y, z),
            axis=one.axis,
            torque=TORQUES[n],
            droop=DROOP,
            armature=ARMATURES[n],
            servo=Servo(GAIN, speed, SHARE),
            limits=(one.low, one.high),
            position=one.name,
            joints=carried,
        )
        carried = (joint,)
    stand = Part(Cylinder(RADII[0], STAND), FOOT_MASS, (x, y, z + STAND / 2))
    senses = (
        Tachometer(path.replace("joint", "velocity"), path) for path in chain.joints
    )
    return Body((stand,), carried, tuple(senses), fixed=True)


def _finger(side: str, out: float) -> Slide:
    x, y, z = FINGER_AT
    return Slide(
        f"arm/finger/{side}",
        (Part(Box(FINGER), FINGER_MASS, (0.0, 0.0, FINGER[2] / 2), friction=0.8),),
        at=(x, out * y, z),
        axis=(0.0, out, 0.0),
        force=FINGER_FORCE,
        droop=FINGER_SPEED / 10,
        armature=FINGER_MOTOR,
        command="arm/gripper",
        servo=Servo(GAIN, FINGER_SPEED, SHARE),
        limits=(0.0, FINGER_TRAVEL),
        position="arm/gripper",
    )
