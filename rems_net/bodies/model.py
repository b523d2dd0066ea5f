"""Model: a robot that a file describes, URDF or MJCF, and the motors of its joints.

Geometry, masses, axes, limits and friction in the joints come from the file; motors,
sensors, and the robot's pose come from the definition.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rems_net.bodies.joints import Servo
from rems_net.bodies.sensors import Sensor
from rems_net.errors import SchemaError

#: friction of a URDF's links, since a URDF has none
FRICTION = 0.5


@dataclass(frozen=True, slots=True)
class Driven:
    """A joint of the file that a motor moves; words as of a `Hinge` or a `Slide`.

    name: of the joint, as in the file
    droop: loss of speed at full effort, rad/s of a hinge, m/s of a slide
    effort: greatest effort of the motor, N m or N; None for the file's limit
    armature: inertia of the motor and its gears, kg m2 or kg; None for the file's
    command, servo, position: as of a Hinge; command is the name if not given
    """

    name: str
    droop: float
    effort: float | None = None
    armature: float | None = None
    command: str = ""
    servo: Servo | None = None
    position: str = ""


@dataclass(frozen=True, slots=True)
class Model:
    """A robot from a user's file, URDF or MJCF; `body()` may return it.

    file: its path
    joints: those that motors move; all others turn freely
    sensors: as of a Body, with places in the frame of the file's first link
    height: of that frame above the floor, m; None for the MJCF's height, or so that the
        lowest point touches the floor; for a fixed robot not less than 0
    fixed: whether it cannot move, as an arm on a table
    held: joints that stay at zero, as if there were none
    friction: Coulomb's coefficient of all links, or by link, such as {"caster": 0.0};
        for other links that of the MJCF, or 0.5
    root: name of the body that is the robot, if an MJCF has several
    mend: whether links with an impossible inertia get that of a ball
    packages: folder of `package://`; None for the nearest one that fits
    """

    file: str | Path
    joints: tuple[Driven, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    height: float | None = None
    fixed: bool = False
    held: tuple[str, ...] = ()
    friction: float | Mapping[str, float] | None = None
    root: str = ""
    mend: bool = False
    packages: str | Path | None = None

    def __post_init__(self) -> None:
        names = [*(joint.name for joint in self.joints), *self.held]
        for name in names:
            if names.count(name) > 1:
                raise SchemaError(
                    f"The Model of {Path(self.file).name} names the joint {name!r} "
                    "twice; a joint is driven once, or held, or neither. (R0213)"
                )


@dataclass(frozen=True, slots=True)
class Source:
    """The file that an engine loads for a body.

    path: of the user's file
    urdf: the same robot as plain URDF, see `bodies.files.urdf`; "" for an MJCF
    plain, grips: of an MJCF for PyBullet: the robot as plain URDF, see
        `bodies.files.plain`, and the friction of its links
    root: name of its first link or body
    held: joints of the file that are left out
    friction: as of a Model
    """

    path: Path
    urdf: str
    root: str
    held: tuple[str, ...] = ()
    friction: float | Mapping[str, float] | None = None
    plain: str = ""
    grips: Mapping[str, float] = field(default_factory=dict)

    def grip(self, link: str) -> float | None:
        """Return the friction of a link; None for the file's."""
        if self.friction is None or isinstance(self.friction, Mapping):
            said = (self.friction or {}).get(link)
            return FRICTION if said is None and self.urdf else said
        return self.friction
