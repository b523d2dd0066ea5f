"""Trees of joints: where links are, how loops close, what rollers make of a wheel."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from rems_net.bodies.body import Body, Box, Cylinder, Hinge, Loop, Part, Servo, Slide
from rems_net.bodies.parts import lump
from rems_net.bodies.tree import Tree, across
from rems_net.errors import SchemaError

ROD = (Part(Box((0.01, 0.01, 0.1)), 0.1),)
UP, LEFT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
DIAGONAL = (0.5**0.5, 0.5**0.5, 0.0)


def four_bar(coupler: float = 0.1) -> Body:
    """Two cranks 0.1 m long, 0.1 m apart, and a coupler between their ends."""
    at = (0.0, 0.0, 0.1)
    knee = Hinge("knee", ROD, at, LEFT)
    driven = Hinge(
        "driven", ROD, (0.0, 0.0, 0.0), LEFT, torque=1.0, droop=0.1, joints=(knee,)
    )
    follower = Hinge("follower", ROD, (0.1, 0.0, 0.0), LEFT)
    loop = Loop("knee", "follower", (coupler, 0.0, 0.1))
    return Body(ROD, (driven, follower), fixed=True, loops=(loop,))


def test_links_are_numbered_each_before_what_it_carries() -> None:
    tree = Tree(four_bar())
    assert [link.joint.name for link in tree.links] == ["driven", "knee", "follower"]
    assert [link.parent for link in tree.links] == [-1, 0, -1]
    assert tree.motors == (0,)


def test_places_are_those_of_a_planar_arm_with_a_slide_at_its_end() -> None:
    tool = Slide("tool", ROD, (0.0, 0.0, 0.2), UP)
    elbow = Hinge("elbow", ROD, (0.0, 0.0, 0.3), LEFT, joints=(tool,))
    tree = Tree(
        Body(ROD, (Hinge("shoulder", ROD, (0, 0, 0.1), LEFT, joints=(elbow,)),))
    )
    a, b, out = 0.4, -1.1, 0.05
    points, turns = tree.places([a, b, out])
    tip = [
        0.3 * sin(a) + (0.2 + out) * sin(a + b),
        0.0,
        0.1 + 0.3 * cos(a) + (0.2 + out) * cos(a + b),
    ]
    assert points[2] == pytest.approx(tip)
    assert turns[2] @ UP == pytest.approx([sin(a + b), 0.0, cos(a + b)])


@pytest.mark.parametrize("angle", [-1.2, -0.3, 0.0, 0.9, 1.4])
def test_a_parallelogram_stays_one(angle: float) -> None:
    found = Tree(four_bar()).closed({0: angle})
    assert found == pytest.approx([angle, -angle, angle], abs=1e-8)


def test_a_loop_that_cannot_close_says_so() -> None:
    """A coupler of 50 mm between cranks whose ends are further apart than that."""
    with pytest.raises(SchemaError, match=r"loops cannot be closed.*`initial`"):
        Tree(four_bar(coupler=0.05)).closed({0: pi})


def test_joints_that_are_named_alike_or_not_at_all_are_refused() -> None:
    twice = Hinge("knee", ROD, (0, 0, 0), LEFT)
    with pytest.raises(SchemaError, match=r"called 'knee'.*obey one `command`"):
        Tree(Body(ROD, (twice, twice)))
    with pytest.raises(SchemaError, match=r"no joint 'hip'; its joints: knee"):
        Tree(Body(ROD, (twice,), loops=(Loop("knee", "hip", (0, 0, 0)),)))


@pytest.mark.parametrize(("torque", "droop"), [(-1.0, 1.0), (1.0, 0.0), (1.0, -1.0)])
def test_motors_that_cannot_be_are_refused(torque: float, droop: float) -> None:
    with pytest.raises(SchemaError, match=r"motor of 'a' has torque"):
        Hinge("a", ROD, (0, 0, 0), LEFT, torque=torque, droop=droop)
    with pytest.raises(SchemaError, match=r"motor of 'a' has force"):
        Slide("a", ROD, (0, 0, 0), UP, force=torque, droop=droop)


@pytest.mark.parametrize(("gain", "speed"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0)])
def test_servos_that_cannot_be_are_refused(gain: float, speed: float) -> None:
    with pytest.raises(SchemaError, match="expected both above 0"):
        Servo(gain, speed)


def test_joints_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(SchemaError, match="servo of 'a' has no motor: give it a torq"):
        Hinge("a", ROD, (0, 0, 0), LEFT, servo=Servo(1.0, 1.0))
    with pytest.raises(SchemaError, match=r"limits of 'a' are .*the lower one first"):
        Slide("a", ROD, (0, 0, 0), UP, limits=(0.1, 0.0))


def test_a_free_joint_that_is_in_no_loop_starts_where_it_is_put() -> None:
    body = four_bar()
    bell = Hinge("bell", ROD, (0.0, 0.0, -0.1), LEFT)
    tree = Tree(replace(body, joints=(*body.joints, bell)))
    found = tree.closed({0: 0.5, tree.number("bell"): 0.3})
    assert found == pytest.approx([0.5, -0.5, 0.5, 0.3], abs=1e-8)


def test_rollers_keep_power_and_kinetic_energy() -> None:
    tyre = Part(Cylinder(0.05, 0.04, axis=LEFT), 0.4, at=(0.0, 0.01, 0.0))
    wheel = Hinge(
        "w",
        (tyre,),
        (0, 0, 0),
        LEFT,
        torque=2.0,
        droop=0.5,
        armature=0.01,
        rollers=DIAGONAL,
    )
    plain = across(wheel)
    speed = 3.0
    turns = speed * wheel.grip
    assert plain.axis == pytest.approx((-DIAGONAL[1], DIAGONAL[0], 0.0))
    assert plain.torque * turns == pytest.approx(wheel.torque * speed)

    def energy(hinge: Hinge, speed: float) -> float:
        axis = np.array(hinge.axis)
        inertia = axis @ lump(hinge.parts).inertia @ axis + hinge.armature
        return float(inertia * speed**2 / 2)

    assert energy(plain, turns) == pytest.approx(energy(wheel, speed))


def test_rollers_that_cannot_roll_are_refused() -> None:
    tyre = Part(Cylinder(0.05, 0.04, axis=LEFT), 0.4)
    for rollers in (LEFT, UP):
        with pytest.raises(SchemaError, match="lie flat and not along the axle"):
            Hinge("w", (tyre,), (0, 0, 0), LEFT, torque=2.0, droop=0.5, rollers=rollers)
    with pytest.raises(SchemaError, match=r"expected of it one part, a\s+cylinder"):
        across(
            Hinge("w", ROD, (0, 0, 0), LEFT, torque=2.0, droop=0.5, rollers=DIAGONAL)
        )
    with pytest.raises(SchemaError, match="expected of it one part"):
        across(Hinge("w", (), (0, 0, 0), LEFT, torque=2.0, droop=0.5, rollers=DIAGONAL))
