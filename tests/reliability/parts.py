"""What a reliability experiment is made of. Each agent leaves its process id in `out`.

`Serial` is the driver under test: it drives a device of `programs/device.py`.
"""

import math
import os
import threading
import time

from rems_net import Definition, Driver, In, Input, Out, Output, Process, Schema, Tick
from rems_net.agents.agent import Agent
from rems_net.defdict import DefDict, angle, angular_velocity, length, velocity
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.serial import SerialDriven
from rems_net.drivers.remote import Remote
from rems_net.errors import WireError

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


class FreeCommander(Commander):
    """The same; nobody waits for it, and what it said last is what it says."""

    lockstep = False


class Relay(Process):
    """Says at every tick what it heard last, however old that is."""

    heard_from = In(COMMAND)
    value = Out(COMMAND)

    def step(self, tick: Tick) -> None:
        self.value = self.heard_from.copy()


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


class Serial(SerialDriven):
    """A cart behind a serial line: a device of `programs/device.py`."""

    def open(self) -> None:
        super().open()
        leave_pid(self)

    def exchange(self, command: DefDict) -> Readings:
        line = f"V {command.speed:.6f} {command.turn:.6f}\n"
        word, *numbers = self.ask(line.encode("ascii")).split()
        if word != b"S" or len(numbers) != 5:
            raise WireError(f"the device says {word!r} and {len(numbers)} numbers")
        x, y, heading = map(float, numbers[:3])
        return {"state": {"x": x, "y": y, "heading": heading}}


class Elsewhere(Remote):
    """The cart of another run."""

    def open(self) -> None:
        super().open()
        leave_pid(self)


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
