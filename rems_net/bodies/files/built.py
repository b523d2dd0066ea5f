"""Built: the body that a model's file describes, with the definition's motors."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from rems_net.bodies.body import Body
from rems_net.bodies.files import mjcf, urdf
from rems_net.bodies.files.sheet import Moved, Sheet, Solid, no_joint
from rems_net.bodies.joints import Hinge, Joint, Slide
from rems_net.bodies.model import Driven, Model, Source
from rems_net.bodies.parts import Box, Part, Sphere
from rems_net.errors import SchemaError
from rems_net.kinematics.rotation import three
from rems_net.libraries import load
from rems_net.system.reading import DESCRIPTION, read_file

#: library that reads an MJCF
MUJOCO = "mujoco"
#: m. Radius of a part that has no shape for contacts.
POINT = 0.001


def built(body: Body | Model, engines: Sequence[str] = (MUJOCO,)) -> Body:
    """Return a body; for a Model, the body of its file. Raises SchemaError.

    engines: libraries of the physics engines that will load the file
    """
    return _built(body, read(body, engines)) if isinstance(body, Model) else body


def read(model: Model, engines: Sequence[str] = (MUJOCO,)) -> Sheet:
    """Return the content of the model's file. Raises SchemaError."""
    path = Path(model.file)
    try:
        root = ElementTree.fromstring(read_file(path, DESCRIPTION))
    except OSError as error:
        raise SchemaError(
            f"The robot's file {path} cannot be read: {error.strerror}. Give Model the "
            "path of a URDF or an MJCF, such as Path(__file__).parent / "
            "'arm.urdf'. (R0201)"
        ) from None
    except (ElementTree.ParseError, LookupError) as error:
        raise SchemaError(f"{path.name} is no XML: {error}. (R0202)") from None
    if any("xacro" in element.tag for element in root.iter()):
        made = f"{path.name.partition('.')[0]}_made.urdf"
        raise SchemaError(
            f"{path.name} is written in xacro, which makes a URDF. Type: xacro "
            f"{path.name} > {made} (R0203)"
        )
    match root.tag:
        case "robot":
            sheet = urdf.read(model, path, root)
        case "mujoco":
            # MuJoCo reads it, for PyBullet, too.
            plain = engines != (MUJOCO,)
            sheet = mjcf.read(load(MUJOCO, MUJOCO), model, path, plain=plain)
        case _:
            raise SchemaError(
                f"{path.name} begins with <{root.tag}>; a URDF with <robot>, an MJCF "
                "with <mujoco>. (R0202)"
            )
    if sheet.bolted and not model.fixed:
        raise SchemaError(
            f"{path.name} holds its robot to the world: give the Model "
            "fixed=True. (R0208)"
        )
    return sheet


def _built(model: Model, sheet: Sheet) -> Body:
    driven = {joint.name: joint for joint in model.joints}
    known = [joint.name for joint in sheet.joints]
    for name in driven:
        if name not in known:
            raise no_joint(sheet.name, name, known)
    if not model.fixed and not sheet.touches:
        raise SchemaError(
            f"{sheet.name} has nothing that touches the floor, through which its robot "
            f"would fall: give its links shapes ({sheet.shapes}), or "
            "fixed=True. (R0208)"
        )
    motors = [_motor(sheet, joint, driven) for joint in sheet.joints]
    carried: dict[int, list[Joint]] = {}
    for number in reversed(range(len(sheet.joints))):
        moved = sheet.joints[number]
        on_it = tuple(reversed(carried.get(number, [])))
        joint = _joint(sheet, moved, motors[number], on_it)
        carried.setdefault(moved.parent, []).append(joint)
    height = model.height
    if height is None:
        height = sheet.height
    if height is None:
        height = max(0.0, -sheet.low) if model.fixed else -sheet.low
    return Body(
        _parts(sheet.base),
        tuple(reversed(carried.get(-1, []))),
        model.sensors,
        height=height,
        fixed=model.fixed,
        source=Source(
            sheet.path,
            sheet.urdf,
            sheet.root,
            model.held,
            model.friction,
            sheet.plain,
            sheet.grips,
        ),
    )


def _motor(
    sheet: Sheet, moved: Moved, driven: dict[str, Driven]
) -> tuple[Driven | None, float]:
    """Return the motor of a joint, and the joint's ratio to the motor's command."""
    if moved.name in driven:
        _check_speed(sheet, moved, driven[moved.name])
        return driven[moved.name], 1.0
    if moved.follows is None or moved.follows[0] not in driven:
        return None, 1.0
    leader, ratio = moved.follows
    motor = driven[leader]
    effort = None if moved.effort else motor.effort
    servo = motor.servo and replace(motor.servo, speed=motor.servo.speed * abs(ratio))
    return replace(
        motor,
        name=moved.name,
        effort=effort,
        command=motor.command or leader,
        servo=servo,
        droop=motor.droop * abs(ratio),
    ), ratio


def _joint(
    sheet: Sheet,
    moved: Moved,
    motor: tuple[Driven | None, float],
    joints: Sequence[Joint],
) -> Joint:
    told, ratio = motor
    about: dict[str, Any] = {
        "parts": _parts(moved.solid),
        "at": moved.at,
        "axis": moved.axis,
        "limits": moved.limits,
        "damping": moved.damping,
        "armature": moved.armature,
        "joints": tuple(joints),
    }
    effort = 0.0
    if told is not None:
        effort = _effort(sheet, moved, told)
        for word in ("droop", "command", "servo", "position"):
            about[word] = getattr(told, word)
        about["ratio"] = ratio
        if told.armature is not None:
            about["armature"] = told.armature
    if moved.turns:
        return Hinge(moved.name, torque=effort, **about)
    return Slide(moved.name, force=effort, **about)


def _effort(sheet: Sheet, moved: Moved, told: Driven) -> float:
    unit = "N m" if moved.turns else "N"
    if told.effort is None:
        if not moved.effort:
            raise SchemaError(
                f"{sheet.name} has no effort for joint {moved.name!r}: give "
                f"Driven({told.name!r}) an effort, {unit}. (R0209)"
            )
        return moved.effort
    if moved.effort and told.effort > moved.effort * (1 + 1e-6):
        raise SchemaError(
            f"Driven({told.name!r}) has an effort of {told.effort:g} {unit}, and "
            f"{sheet.name} allows {moved.effort:g}: give it no more, or leave it "
            "out. (R0209)"
        )
    return told.effort


def _check_speed(sheet: Sheet, moved: Moved, told: Driven) -> None:
    if told.servo and moved.speed and told.servo.speed > moved.speed * (1 + 1e-6):
        unit = "rad/s" if moved.turns else "m/s"
        raise SchemaError(
            f"The servo of Driven({told.name!r}) goes at {told.servo.speed:g} {unit}, "
            f"and {sheet.name} allows {moved.speed:g}: give it no more. (R0209)"
        )


def _parts(solid: Solid) -> tuple[Part, ...]:
    """Return boxes around the shapes that can touch; they share the mass."""
    count = len(solid.boxes)
    if not count:
        return (Part(Sphere(POINT), solid.mass, friction=None),)
    return tuple(
        Part(Box(three(size)), solid.mass / count, three(middle))
        for middle, size in solid.boxes
    )
