"""Driver: a program outside of any run that tells a Woodbot something every tick.

`python -m tests.firmware.posix.driver ENDPOINT ROBOT` does so until its standard input
is closed.
"""

import json
import sys
import time
from contextlib import ExitStack
from threading import Lock
from typing import Any

import zenoh
from msgpack import packb, unpackb

from rems_net.robots.woodbot import Woodbot

#: how many values follow each other before one comes again
VALUES = 40


def speed(k: int) -> float:
    """What the left wheel is told as the k-th [rad/s]."""
    return 2.0 + 0.1 * (k % VALUES)


def pulse(k: int) -> int:
    """What a servo with the default settings gets for it [us]."""
    return 1500 + round(500 * speed(k) / 7.3)


class Driver:
    """It speaks plain Zenoh, and finds its router again by itself."""

    def __init__(self, endpoint: str, robot: str):
        schema = Woodbot.command.schema_for(Woodbot(robot).parameters)
        assert schema is not None
        self._encoding = f"application/msgpack;{schema.name}@{schema.digest}"
        self._key = f"rems/robot/{robot}/command"
        #: when the k-th command was put (CLOCK_MONOTONIC, s)
        self.told: list[float] = []
        #: stamps of what the robot says it obeys: [n, t, badge] or [n, t, badge, said]
        self.obeyed: list[Any] = []
        retry = {"period_init_ms": 100, "period_max_ms": 200}
        told = {
            "mode": "client",
            "connect": {"endpoints": [endpoint], "retry": retry, "timeout_ms": -1},
            "scouting": {"multicast": {"enabled": False}},
            "transport": {"shared_memory": {"enabled": False}},
        }
        self._using, self._closed = Lock(), False
        self._stack = ExitStack()
        self._session = self._stack.enter_context(
            zenoh.open(zenoh.Config.from_json5(json.dumps(told)))
        )
        ticks = self._session.declare_subscriber("rems/clock/tick", self._tick)
        self._ticks: Any = ticks  # zenoh's stub leaves `undeclare` untyped
        self._session.declare_subscriber(self._key, self._echo)

    def _tick(self, sample: zenoh.Sample) -> None:
        n, t = unpackb(sample.payload.to_bytes())[1:3]
        left = speed(len(self.told))
        command = packb({"wheel": {"left": left, "right": left}})
        self.told.append(time.monotonic())
        stamp = packb([n, t])
        about: dict[str, Any] = {"encoding": self._encoding, "attachment": stamp}
        with self._using:
            if not self._closed:
                self._session.put(self._key, command, **about)

    def _echo(self, sample: zenoh.Sample) -> None:
        if sample.attachment is not None:
            stamp = unpackb(sample.attachment.to_bytes())
            if len(stamp) > 2:  # not our own
                self.obeyed.append(stamp)

    def close(self) -> None:
        self._ticks.undeclare()
        with self._using:  # a session that is in use refuses to be closed
            self._closed = True
        self._stack.close()


if __name__ == "__main__":
    driver = Driver(*sys.argv[1:])
    sys.stdin.read()
    driver.close()
