"""Faults of a robot's router, its way there and its Wi-Fi; and one trial of each."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from typing import NamedTuple

from tests.firmware.posix.scene import Scene
from tests.firmware.posix.valve import Valve
from tests.reliability.rig.programs import until

#: seconds of wall time: it stands still, and it is driven again
STANDS, BACK = 0.6, 6.0
#: a busy machine may be this much slower before a test fails
TIMEOUT = 60.0


class Trial(NamedTuple):
    """After how many seconds it stood still, and was driven again."""

    stood: float
    back: float


@dataclass(frozen=True)
class Fault:
    """`prepare` starts a robot; `undo` returns when the way was there again."""

    prepare: Callable[[Scene], None]
    do: Callable[[Scene], None]
    undo: Callable[[Scene], float]
    lasts: float = 3.0


def trial(scene: Scene, fault: Fault) -> Trial:
    """Do it to a robot that is driven, and undo it. Raises if it moves meanwhile."""
    robot = scene.robot
    robot.moved(time.monotonic(), TIMEOUT)
    at = time.monotonic()
    fault.do(scene)
    stood = robot.stood(at, TIMEOUT)
    Event().wait(max(0.0, at + fault.lasts - time.monotonic()))
    late = [one for one in robot.pulses() if one.at > stood and not one.stands]
    assert not late, f"it moved, {late[0].at - at:.2f} s after it was cut off"
    returned = fault.undo(scene)
    return Trial(stood - at, robot.moved(returned, TIMEOUT) - returned)


# -- the router ------------------------------------------------------------------------


def _plain(*words: str) -> Callable[[Scene], None]:
    def prepare(scene: Scene) -> None:
        scene.serve()
        scene.start(*words)
        scene.drive()

    return prepare


def _kill(scene: Scene) -> None:
    scene.server.kill()


def _again(scene: Scene) -> float:
    return scene.serve()


def _freeze(scene: Scene) -> None:
    scene.server.freeze()


def _thaw(scene: Scene) -> float:
    scene.server.thaw()
    return time.monotonic()


def _moves(scene: Scene) -> None:
    """Start with a second address, at which nobody is yet."""
    scene.serve()
    scene.start("--set", f"router2={scene.other}")
    scene.drive()


def _elsewhere(scene: Scene) -> float:
    at = scene.serve(scene.other if scene.endpoint != scene.other else scene.first)
    scene.drive()
    return at


# -- the way there ---------------------------------------------------------------------


def _behind_valve(scene: Scene) -> None:
    scene.serve()
    scene.start_behind_valve()
    scene.drive()


def _valve(scene: Scene) -> Valve:
    assert scene.valve is not None
    return scene.valve


def _shut(*, swallow: bool) -> Callable[[Scene], None]:
    return lambda scene: _valve(scene).shut(swallow=swallow)


def _open(*, forgotten: bool) -> Callable[[Scene], float]:
    def undo(scene: Scene) -> float:
        at = time.monotonic()
        _valve(scene).open(forgotten=forgotten)
        return at

    return undo


# -- names and Wi-Fi -------------------------------------------------------------------


def _named(scene: Scene) -> None:
    scene.serve()
    scene.start(router=scene.endpoint.replace("127.0.0.1", "localhost"))
    scene.drive()


def _nameless(scene: Scene) -> None:
    scene.robot.control("names slow")
    scene.server.kill()


def _in_wifi(scene: Scene) -> None:
    settings = ("--set", "ssid=LAB", "--set", "password=secret")
    _plain("--do", "air LAB secret", *settings)(scene)


def _control(line: str) -> Callable[[Scene], float]:
    def do(scene: Scene) -> float:
        at = time.monotonic()
        assert scene.robot.control(line) == "ok"
        return at

    return do


def _say(line: str) -> Callable[[Scene], None]:
    def do(scene: Scene) -> None:
        _control(line)(scene)

    return do


FAULTS = {
    "router killed": Fault(_plain(), _kill, _again),
    "router frozen 3 s": Fault(_plain(), _freeze, _thaw),
    "router frozen 10 s": Fault(_plain(), _freeze, _thaw, 10.0),
    "router frozen 60 s": Fault(_plain(), _freeze, _thaw, 60.0),
    "router at another address": Fault(_moves, _kill, _elsewhere),
    "half-open": Fault(
        _behind_valve, _shut(swallow=False), _open(forgotten=True), 12.0
    ),
    "dropped": Fault(_behind_valve, _shut(swallow=True), _open(forgotten=False), 12.0),
    "killed, and its name no longer resolves": Fault(_named, _nameless, _again),
    "Wi-Fi lost": Fault(_in_wifi, _say("air off"), _control("air on")),
    "Wi-Fi with another password": Fault(
        _in_wifi, _say("air LAB changed"), _control("air LAB secret")
    ),
}


def wait_until_listed(scene: Scene) -> None:
    """Wait until `rems list` shows it."""

    def listed() -> bool:
        program = scene.rig.rems("list", router=scene.endpoint)
        return program.process.wait() == 0 and scene.robot.name in program.text()

    until(listed, "the robot in `rems list`", TIMEOUT)
