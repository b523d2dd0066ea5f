"""What a reliability experiment is made of. Each agent leaves its process id in `out`.

`Serial` is the driver under test: it drives a device of `programs/device.py`.
"""

from __future__ import annotations

import math
import os
import threading
import time

from rems_net import Definition, Driver, In, Input, Out, Output, Schema, Settings, Tick
from rems_net.agents.agent import Agent
from rems_net.defdict import (
    DefDict,
    angle,
    angular_velocity,
    length,
    number,
    text,
    velocity,
)

COMMAND = Schema(
    "cart.command",
    {
        "speed": velocity("m/s", range=(-1, 1)),
        "turn": angular_velocity("rad/s", range=(-2, 2)),
    },
)
STATE = Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})
#: what every robot has last been told
SPEED = 0.5


def leave_pid(agent: Agent) -> None:
    """Write where this agent lives, whole or not at all."""
    path = agent.out / f"{agent.kind}-{agent.name}.pid"
    new = path.with_suffix(".new")
    new.write_text(str(os.getpid()), encoding="utf-8")
    new.replace(path)


class Cart(Definition):
    command = In(COMMAND)
    state = Out(STATE)


class Commander(Input):
    """Says the same speed at every tick."""

    value = Out(COMMAND)

    def open(self) -> None:
        leave_pid(self)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": SPEED, "turn": 0.1}


class Model(Driver):
    """A cart of fabric time. Holds its tick while there is a file `hold` in `out`."""

    def open(self) -> None:
        leave_pid(self)

    def drive(self, command: DefDict, dt: float) -> None:
        while (self.out / "hold").exists():
            threading.Event().wait(0.02)
        state = self.state
        state.x += dt * command.speed * math.cos(state.heading)
        state.y += dt * command.speed * math.sin(state.heading)
        state.heading += dt * command.turn

    def sense(self) -> None:
        pass


class Serial(Driver):
    """A cart behind a serial line, driven by a thread at the device's rate.

    The thread sends what it was last told, again and again: what a driver does that
    knows nothing of ages.
    """

    lockstep = False
    options = Settings(port=text(default=""), rate=number(default=50.0))

    def open(self) -> None:
        self._line = os.open(self.options.port, os.O_RDWR | os.O_NOCTTY)
        self._told = (0.0, 0.0)
        self._pose = (0.0, 0.0, 0.0)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._go, daemon=True)
        self._thread.start()
        leave_pid(self)

    def _go(self) -> None:
        while not self._end.wait(1 / self.options.rate):
            self._exchange(*self._told)

    def _exchange(self, speed: float, turn: float) -> None:
        os.write(self._line, f"V {speed} {turn}\n".encode())
        answer = b""
        while not answer.endswith(b"\n"):
            answer += os.read(self._line, 256)
        x, y, heading = map(float, answer.split()[1:4])
        self._pose = (x, y, heading)

    def drive(self, command: DefDict, dt: float) -> None:
        self._told = (float(command.speed), float(command.turn))

    def sense(self) -> None:
        x, y, heading = self._pose
        self.state = {"x": x, "y": y, "heading": heading}

    def close(self) -> None:
        if hasattr(self, "_thread"):
            self._end.set()
            self._thread.join(1.0)
            self._exchange(0.0, 0.0)
            os.close(self._line)


class Lateness(Output):
    """Writes when each tick came, by the wall clock: `n seconds`."""

    robots = In(source="robot/*/state")

    def open(self) -> None:
        self.file = (self.out / "lateness.txt").open("w", encoding="utf-8")

    def write(self, tick: Tick) -> None:
        print(tick.n, repr(time.monotonic()), file=self.file, flush=True)

    def close(self) -> None:
        if hasattr(self, "file"):
            self.file.close()
