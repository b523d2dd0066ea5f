"""Other robots: planted values of a Create 2 and of a youBot's joint are found."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np

from rems_net import Create2, Settings, YoubotArm
from rems_net.bodies import actuation
from rems_net.drivers.hardware.create2.packets import COUNTS
from rems_net.drivers.kinematic.correction import limits
from rems_net.emulators.create2.body import Body
from rems_net.identification.drive import Drive
from rems_net.identification.identify import identify
from rems_net.identification.prediction import made
from rems_net.identification.result import Identified
from rems_net.kinematics.servo import toward
from rems_net.units import angle
from tests.identification.test_identify import keys

#: s. Time between two rows.
ROW = 0.1


def held(found: Identified, true: Mapping[str, float]) -> None:
    by_name = {one.name: one for one in found.parameters}
    for name, value in true.items():
        assert by_name[name].adopted, by_name[name].why
        assert abs(by_name[name].value - value) <= by_name[name].half


def test_an_emulated_create_2() -> None:
    """Its wheels are read by its own counters, its heading by a compass of 1 degree."""
    true = {"track": 0.229, "actuation/lag": 0.12}
    body, random = Body(parameters=true), np.random.default_rng(2)
    shares = np.array([keys(random, 150), keys(random, 150)])
    rows: list[tuple[float, ...]] = []
    counts = np.zeros(2)
    for share in np.c_[np.zeros(2), shares].T:
        body.left, body.right = (round(500 * one) for one in share.tolist())
        before = np.array(body._counts())
        body.move(ROW)
        counts += np.array(body._counts()) - before
        wheels = counts * 2 * pi / COUNTS
        heading = body.robot.state["heading"] + np.deg2rad(random.standard_normal())
        rows.append((body.left / 500, body.right / 500, *wheels, float(heading)))
    left, right, *state = np.array(rows).T
    paths = ("wheel/left", "wheel/right", "heading")
    drive = Drive(
        "create2",
        ROW * np.arange(len(left), dtype=np.float64),
        {"wheel/left": left, "wheel/right": right},
        dict(zip(paths, state, strict=True)),
    )
    held(identify([drive], Create2, names=[*true]), true)


class Joint(YoubotArm):
    """An arm whose first joint lags, and reads an angle that is off."""

    parameters = Settings(
        {
            **YoubotArm.parameters.fields,
            "zero": angle(range=(-0.5, 0.5)),
            "actuation": actuation("arm/joint/1"),
        }
    )

    def advance(self, state: Any, command: Any, dt: float) -> dict[str, Any]:
        gone = super().advance(state, command, dt)
        p, path = self.parameters, "arm/joint/1"
        most = command["arm/speed"] * p.joint_speed * dt
        return gone | {path: toward(state[path], command[path] + p.zero, most)}


def test_a_joint_of_a_youbot() -> None:
    true = {"zero": 0.06, "actuation/lag": 0.25}
    robot, random = made(Joint, true), np.random.default_rng(3)
    paths = robot.command.schema.paths
    goals = [float(random.uniform(-2.0, 2.0)) for _ in range(20)]
    told, read = [], []
    for n in range(300):
        goal = {"arm/joint/1": goals[n // 15], "arm/speed": 1.0} if n else {}
        robot.command = robot.command.schema(goal)
        robot.drive(robot.acting(ROW), ROW)
        told.append(robot.command.to_array())
        off = 0.003 * random.standard_normal()
        read.append(robot.state["arm/joint/1"] + float(off))
    columns, most = np.array(told).T, limits(robot.command.schema)
    drive = Drive(
        "arm",
        ROW * np.arange(len(read), dtype=np.float64),
        {p: column / most[p] for p, column in zip(paths, columns, strict=True)},
        {"arm/joint/1": np.array(read)},
    )
    held(identify([drive], Joint, names=[*true]), true)
