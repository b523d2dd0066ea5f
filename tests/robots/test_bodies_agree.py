"""The bodies that physics moves bend as the arms' kinematics say."""

from __future__ import annotations

import numpy as np
import pytest

from rems_net.kinematics.arm import Arm
from rems_net.kinematics.fivebar import FiveBarArm
from rems_net.kinematics.rotation import Array
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import JOINTS, PROPORTIONS, Youbot, YoubotArm
from rems_net.worlds.tree import Tree
from tests.kinematics.arms import anywhere, scaler, youbot


def link(tree: Tree, arm: Arm, q: list[float], name: str) -> tuple[Array, Array]:
    """Where a link of the body is, and how it is turned, with the arm's joints there.

    All frames of a body are parallel while its joints are at zero.
    """
    wanted = {tree.number(j): x for j, x in zip(arm.joints, q, strict=True)}
    points, turns = tree.places(tree.closed(wanted))
    number = tree.number(name)
    return points[number], turns[number]


@pytest.mark.parametrize("kind", [YoubotArm, Youbot])
def test_youbot(kind: type[YoubotArm]) -> None:
    robot, arm = kind("bot"), youbot(kind)
    tree, random = Tree(robot.body()), np.random.default_rng(4)
    for _ in range(30):
        q = anywhere(arm, random)
        place, turn = link(tree, arm, q, JOINTS[-1])
        pose = arm.fk(q)
        tool = place + turn @ np.array([0.0, 0.0, PROPORTIONS.tool])
        assert np.abs(pose.position - tool).max() < 1e-9
        assert np.abs(pose.rotation - turn).max() < 1e-9


@pytest.mark.parametrize("side", ["left", "right"])
def test_scaler(side: str) -> None:
    arm: FiveBarArm = scaler(side)
    tree, random = Tree(Scaler("bot").body()), np.random.default_rng(4)
    zero = arm.fk([0.0] * 6)
    for _ in range(8):
        q = anywhere(arm, random)
        place, turn = link(tree, arm, q, f"{side}/wrist/3")
        pose = arm.fk(q)
        wrist = (pose @ arm.tool.inverse()).position
        assert np.abs(wrist - place).max() < 1e-8
        assert np.abs(pose.rotation - turn @ zero.rotation).max() < 1e-8
