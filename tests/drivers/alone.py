"""Robots outside of a host: opened, and told what to do again and again, as by one."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from tests.agents.runs import calm


@contextmanager
def opened(robot: Any) -> Iterator[Any]:
    """Prepared and opened; closed at the end."""
    robot.prepare()
    try:
        robot.open()
        yield robot
    finally:
        robot.close()


def keep(
    robot: Any,
    command: Mapping[str, float],
    until: Callable[[], Any],
    seconds: float = 20.0,
    every: float = 0.02,
) -> Any:
    """Tell it this until something is so; what that is."""
    end = calm() + seconds
    while not (found := until()):
        assert calm() < end, robot.figures()
        robot.command = command
        robot.drive(robot.command, every)
        robot.sense()
        time.sleep(every)
    return found


def keep_for(
    robot: Any, command: Mapping[str, float], seconds: float, every: float = 0.02
) -> None:
    """Tell it this for so long."""
    end = time.monotonic() + seconds
    keep(robot, command, lambda: time.monotonic() > end, seconds + 20, every)
