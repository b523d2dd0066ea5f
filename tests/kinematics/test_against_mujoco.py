"""Forward kinematics and Jacobians are those of MuJoCo, to 1e-9."""

from collections.abc import Sequence
from math import atan2, cos, sin
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pytest

from rems_net.kinematics.chain import Chain, ChainJoint
from rems_net.kinematics.fivebar import FiveBarArm
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import Array
from tests.kinematics.arms import anywhere, crane, scaler, youbot

mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed (an extra)")
CLOSE = 1e-9


class Model:
    """A tree of joints in MuJoCo, and where its sites are."""

    def __init__(self) -> None:
        self.root = Element("mujoco")
        SubElement(self.root, "compiler", angle="radian")
        self.world = SubElement(self.root, "worldbody")

    def placed(self, parent: Element, pose: Pose) -> Element:
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, pose.rotation.ravel())
        return SubElement(parent, "body", pos=_text(pose.position), quat=_text(quat))

    def jointed(self, parent: Element, joint: ChainJoint) -> Element:
        link = SubElement(parent, "body", pos=_text(joint.at))
        kind = "slide" if joint.slides else "hinge"
        SubElement(link, "joint", name=joint.name, type=kind, axis=_text(joint.axis))
        SubElement(link, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
        return link

    def site(self, parent: Element, name: str, pose: Pose) -> None:
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, pose.rotation.ravel())
        place = {"pos": _text(pose.position), "quat": _text(quat)}
        SubElement(parent, "site", place, name=name)

    def bend(self, joints: dict[str, float]) -> None:
        """Build it, and put its joints there."""
        self.model = mujoco.MjModel.from_xml_string(
            tostring(self.root, encoding="unicode")
        )
        self.data = mujoco.MjData(self.model)
        for name, angle in joints.items():
            self.data.joint(name).qpos = angle
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def pose(self, site: str) -> tuple[Array, Array]:
        found = self.data.site(site)
        return found.xpos, found.xmat.reshape(3, 3)

    def jacobian(self, site: str, joints: Sequence[str]) -> Array:
        whole = np.zeros((6, self.model.nv))
        number = self.model.site(site).id
        mujoco.mj_jacSite(self.model, self.data, whole[:3], whole[3:], number)
        columns = [int(self.model.joint(name).dofadr[0]) for name in joints]
        picked: Array = whole[:, columns]
        return picked


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in np.ravel(numbers))


@pytest.mark.parametrize("chain", [youbot(), crane()], ids=["youbot", "crane"])
def test_a_chain(chain: Chain) -> None:
    model = Model()
    link = model.placed(model.world, chain.base)
    for joint in chain.links:
        link = model.jointed(link, joint)
    model.site(link, "tool", chain.tool)
    random = np.random.default_rng(13)
    for _ in range(50):
        q = anywhere(chain, random)
        model.bend(dict(zip(chain.joints, q, strict=True)))
        pose, (position, rotation) = chain.fk(q), model.pose("tool")
        assert np.abs(pose.position - position).max() < CLOSE
        assert np.abs(pose.rotation - rotation).max() < CLOSE
        theirs = model.jacobian("tool", chain.joints)
        assert np.abs(chain.jacobian(q) - theirs).max() < CLOSE


def linkage(arm: FiveBarArm) -> Model:
    """Both halves of the linkage, which MuJoCo does not know to be one."""
    model, bars = Model(), arm.bars
    here, back = (0.0, 0.0, 0.0), (0.0, -1.0, 0.0)
    crank = (0.0, 0.0, -bars.crank)
    shoulder = model.placed(model.world, arm.base)
    shoulder = model.jointed(shoulder, ChainJoint("shoulder", here, (0.0, 0.0, 1.0)))
    top = model.jointed(shoulder, ChainJoint("top", (bars.ahead, 0.0, bars.top), back))
    upper = model.jointed(top, ChainJoint("upper", crank, back))
    model.site(upper, "first", Pose.of((0.0, 0.0, -bars.upper)))
    low = ChainJoint("bottom", (bars.ahead, 0.0, bars.bottom), back)
    bottom = model.jointed(shoulder, low)
    plate = model.jointed(bottom, ChainJoint("plate", crank, back))
    edge = (-sin(bars.bent) * bars.lower, 0.0, -cos(bars.bent) * bars.lower)
    model.site(plate, "second", Pose.of(edge))
    wrist = ChainJoint("wrist/1", (0.0, 0.0, -bars.tip), (1.0, 0.0, 0.0))
    link = model.jointed(plate, wrist)
    link = model.jointed(link, ChainJoint("wrist/2", here, (0.0, 1.0, 0.0)))
    link = model.jointed(link, ChainJoint("wrist/3", here, (0.0, 0.0, -1.0)))
    model.site(link, "tool", arm.hand @ arm.tool)
    return model


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_five_bar_linkage_closes_and_moves_as_its_two_halves_do(side: str) -> None:
    arm = scaler(side)
    model, bars = linkage(arm), arm.bars
    active = [name.partition("/")[2] for name in arm.joints]
    random = np.random.default_rng(13)
    for _ in range(50):
        q = anywhere(arm, random)
        joints = dict(zip(active, q, strict=True))
        b, _ = bars.elbows(q[1], q[2])
        c = bars.joint(q[1], q[2])
        hanging = atan2(c[0] - b[0], b[1] - c[1])
        joints |= {"upper": hanging - q[1], "plate": bars.plate(q[1], q[2]) - q[2]}
        model.bend(joints)
        first, second = model.pose("first")[0], model.pose("second")[0]
        assert np.abs(first - second).max() < CLOSE
        pose, (position, rotation) = arm.fk(q), model.pose("tool")
        assert np.abs(pose.position - position).max() < CLOSE
        assert np.abs(pose.rotation - rotation).max() < CLOSE
        # The two links that no servo turns follow so that both sites stay together.
        passive = ["upper", "plate"]
        apart = {
            names: model.jacobian("first", names) - model.jacobian("second", names)
            for names in (tuple(active), tuple(passive))
        }
        held, free = (apart[names][:3] for names in (tuple(active), tuple(passive)))
        follow = -np.linalg.lstsq(free, held, rcond=None)[0]
        theirs = model.jacobian("tool", active)
        theirs = theirs + model.jacobian("tool", passive) @ follow
        assert np.abs(arm.jacobian(q) - theirs).max() < CLOSE
