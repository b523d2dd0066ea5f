"""Crew: the emulated Woodbots of one process, from its first word to its end."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from rems_net.agents.host.lifeline import Lifeline
from rems_net.errors import RemsError
from rems_net.firmware.robot import EmulatedRobot, Motors
from rems_net.router.message import read

#: seconds that leaving may take
GRACE = 3.0
#: exit statuses
DONE, WRONG = 0, 2


def main(lifeline: Lifeline) -> int:
    """Run them until nobody needs them any more."""
    told = read(lifeline.words())
    gone = threading.Event()
    lifeline.on_end(gone.set, GRACE)
    folder, user = told["servos"], (told["user"], told["password"])
    try:
        robots = []
        for settings in told["robots"]:
            path = f"{folder}/{settings['name']}.servos"
            log = log_into(path) if folder else None
            robots.append(EmulatedRobot(settings, *user, pulsed=log))
    except (RemsError, OSError) as error:
        print(error, flush=True)
        return WRONG
    sys.setswitchinterval(0.001)  # the motors' thread must not wait for the others
    motors = Motors(robots)
    for robot in robots:
        robot.start()
    motors.start()
    gone.wait()
    for robot in robots:
        robot.leave()
    for robot in robots:
        robot.end()
    motors.end()
    return DONE


def log_into(path: str) -> Callable[[float, int, int], None]:
    """What writes a line for each change of a robot's pulses into a file."""
    file = Path(path).open("w", buffering=1, encoding="ascii")  # noqa: SIM115

    def write(time: float, left: int, right: int) -> None:
        with suppress(OSError):  # a full disk does not stop the robot
            file.write(f"{time:.6f} {left} {right}\n")

    return write
