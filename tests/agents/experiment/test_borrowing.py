"""A robot that is lent to a run: what is told before anything starts."""

from __future__ import annotations

from typing import Any

import pytest

from rems_net import Experiment, Input, Out, Schema, Tick
from rems_net.defdict import percent
from rems_net.errors import ExperimentError, RemsError
from rems_net.robots.woodbot import Woodbot


class Keys(Input):
    value = Out(Schema("keys", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 40.0}


class Speed(Input):
    value = Out(Schema("speed", {"ahead": percent()}))

    def read(self, tick: Tick) -> dict[str, float]:
        return {"ahead": 40.0}


def lab(**more: Any) -> Experiment:
    made = Experiment("lab", duration="1 s", pace=1.0)
    made.input("keys", Keys)
    made.input("speed", Speed)
    made.robot("w7", "woodbot", "lent", **more)
    return made


def test_what_it_is_told_is_in_its_own_units() -> None:
    agents = lab(command="input/keys").check()
    relay = agents["process/w7.command"]
    woodbot = Woodbot("w7", parameters={"max_wheel_speed": 5.0})
    woodbot.prepare()
    assert relay.schemas()["value"] == agents["robot/w7"].schemas()["command"]
    other = lab(command="input/keys", parameters={"max_wheel_speed": 5.0}).check()
    command = other["process/w7.command"].schemas()["value"]
    assert command == woodbot.command.schema


def test_what_does_not_fit_is_told_before_anything_starts() -> None:
    with pytest.raises(RemsError, match=r"wheel/left"):
        lab(command="input/speed").check()


def test_told_by_programs_it_needs_no_relay() -> None:
    assert lab().check().keys() == {"input/keys", "input/speed", "robot/w7"}


def test_it_lives_in_real_time() -> None:
    with pytest.raises(ExperimentError, match=r"robot/w7 is lent, .* pace = 1\.0, or"):
        lab().run(pace="fast")


def test_it_is_not_started() -> None:
    robot = lab().check()["robot/w7"]
    assert not robot.lockstep
    with pytest.raises(ExperimentError, match=r"robot/w7 is lent: it is started by"):
        robot.open()
