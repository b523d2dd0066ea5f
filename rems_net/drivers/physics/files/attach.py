"""Attach: adds a robot's file to MuJoCo's model of a world."""

from itertools import combinations
from typing import Any

from rems_net.bodies.body import Body
from rems_net.bodies.files.mjcf import opened, root_of
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.pictures.looks import WHEEL, hull, is_wheel

#: Stiffness of stops, the same as in bodies without a file, see `mjcf.STIFF`.
STOP = (0.004, 1.0), (0.99, 0.99, 0.001)


def attach(mujoco: Any, world: Any, body: Body, number: int, others: bool) -> None:
    """Put the file's robot on the body `<number>/base`, with the definition's motors.

    world: its MuJoCo spec      others: whether it can touch more than floor and walls
    """
    assert body.source is not None
    prefix = f"{number}/file/"  # the file may have a body called base
    file = opened(mujoco, body.source)
    robot = root_of(file, body.source)
    free = [joint for joint in robot.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    for one in (*free, *file.actuators):
        file.delete(one)
    agree(file, world)
    frame = world.body(f"{number}/base").add_frame()
    root = frame.attach_body(robot, prefix, "")
    root.pos = (0.0, 0.0, 0.0)  # at the base
    wheels = {
        prefix + one.joint.name for one in Tree(body).links if is_wheel(one.joint)
    }
    touching = []
    for link in [root, *root.find_all("body")]:
        grip = body.source.grip(link.name.removeprefix(prefix))
        for geom in link.geoms:
            if body.source.urdf:  # a URDF's visible shapes are those that touch
                dark = any(joint.name in wheels for joint in link.joints)
                geom.rgba = (*(WHEEL if dark else hull(number)), 1.0)
            if geom.contype or geom.conaffinity:
                geom.contype, geom.conaffinity = 1, 3 if others else 2
                if grip is not None:
                    geom.friction = (grip, 0.0, 0.0)
                touching.append(link.name)
    # Parts of one robot never touch each other.
    for first, second in combinations(sorted(set(touching)), 2) if others else ():
        pair = world.add_exclude()
        pair.bodyname1, pair.bodyname2 = first, second
    for link in Tree(body).links:
        joint, name = link.joint, prefix + link.joint.name
        made = world.joint(name)
        made.armature = joint.armature
        if body.source.urdf:  # a URDF does not state the stiffness of its stops
            made.solref_limit, made.solimp_limit[:3] = STOP
        if joint.effort:
            motor = world.add_actuator()
            motor.target, motor.trntype = name, mujoco.mjtTrn.mjTRN_JOINT
            motor.gaintype = mujoco.mjtGain.mjGAIN_FIXED
            motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            motor.gainprm[0] = joint.effort / joint.droop
            motor.biasprm[2] = -joint.effort / joint.droop
            motor.forcelimited = True
            motor.forcerange = (-joint.effort, joint.effort)


def agree(part: Any, whole: Any) -> None:
    """Give a spec the settings of the whole that it becomes a part of.

    MuJoCo warns of each different setting, in a file in the user's folder. The meshes
    that a spec has read must be copied to the whole.
    """
    sizes = [word for word in dir(whole) if word.startswith("nuser_")]
    whole.assets = {**whole.assets, **part.assets}
    for told, held, words in (
        (part.option, whole.option, _public(whole.option)),
        (part.visual.map, whole.visual.map, _public(whole.visual.map)),
        (part, whole, ["memory", *sizes]),
    ):
        for word in words:
            setattr(told, word, getattr(held, word))


def _public(settings: Any) -> list[str]:
    return [word for word in dir(settings) if not word.startswith("_")]
