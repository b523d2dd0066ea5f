"""What an experiment with a robot on wheels is made of, as `parts.py` is for a cart.

Its drivers are those that ship; each leaves its process id in `out`.
"""

import threading
import time

from rems_net import In, Out, Schema, Tick
from rems_net.agents.robot import Driver
from rems_net.defdict import DefDict, angular_velocity
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.drivers.hardware.woodbot_websocket import OriginalFirmware
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.remote import Remote
from tests.reliability import parts

COMMAND = Schema(
    "wheels.command",
    {
        f"wheel/{side}": angular_velocity("rad/s", range=(-6, 6))
        for side in ("left", "right")
    },
)


class Commander(parts.Commander):
    """Says the same speeds at every tick."""

    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 3.0, "wheel/right": 2.0}


class FreeCommander(Commander):
    """The same; nobody waits for it, and what it said last is what it says."""

    lockstep = False


class Relay(parts.Relay):
    """Says at every tick what it heard last, however old that is."""

    heard_from = In(COMMAND)
    value = Out(COMMAND)


class Model(Kinematic):
    """A robot of fabric time. Holds its tick while there is a file `hold` in `out`."""

    def open(self) -> None:
        super().open()
        parts.leave_pid(self)

    def drive(self, command: DefDict, dt: float) -> None:
        while (self.out / "hold").exists():
            threading.Event().wait(0.02)
        super().drive(command, dt)


class Known(Driver):
    """A driver whose process can be found."""

    def open(self) -> None:
        super().open()
        parts.leave_pid(self)


class Elsewhere(Known, Remote):
    """The robot of another run."""


class Logging(Driver):
    """A robot of fabric time that logs, for each tick, when it came and if it moves."""

    def open(self) -> None:
        super().open()
        parts.leave_pid(self)

    def drive(self, command: DefDict, dt: float) -> None:
        super().drive(command, dt)
        moves = any(command[path] for path in COMMAND.paths)
        with (self.out / "moves.log").open("a", encoding="utf-8") as log:
            print(time.monotonic(), moves, file=log)


class Modelled(Logging, Kinematic):
    """A robot by its equations."""


class Simulated(Logging, Mujoco):
    """A robot in MuJoCo."""


class Create2(Known, OpenInterface):
    """A Create 2 at a serial line."""


class Dynabot(Known, Wheels):
    """A Dynabot at a serial line."""


class WebSocketWoodbot(Known, OriginalFirmware):
    """A Woodbot with the first firmware of the class."""
