"""A cart, the driver of its firmware in `device.py`, and drivers that make mistakes."""

import math
import os
from typing import Any

from rems_net import Definition, In, Input, Out, Schema, Settings, Tick
from rems_net.defdict import (
    DefDict,
    angle,
    angular_velocity,
    integer,
    length,
    number,
    text,
    velocity,
)
from rems_net.drivers.hardware.driven import Driven
from rems_net.drivers.hardware.serial import SerialDriven
from rems_net.errors import WireError

COMMAND = Schema(
    "cart.command",
    {
        "speed": velocity("m/s", range=(-1, 1)),
        "turn": angular_velocity("rad/s", range=(-2, 2)),
    },
)


class Cart(Definition):
    command = In(COMMAND)
    state = Out(
        Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})
    )


def check(text: str) -> str:
    return f"{sum(text.encode()) % 256:02x}"


def request(count: int, command: DefDict) -> bytes:
    text = f"{count} {command.speed!r} {command.turn!r}"
    return f"{text} {check(text)}\n".encode()


def readings(count: int, reply: bytes) -> dict[str, dict[str, float]]:
    text, _, mark = reply.decode(errors="replace").strip().rpartition(" ")
    words = text.split()
    if check(text) != mark or words[0] != str(count):
        raise WireError(f"expected an answer to {count}, and {reply!r} came")
    x, y, heading = map(float, words[1:])
    return {"state": {"x": x, "y": y, "heading": heading}}


class SerialCart(SerialDriven):
    """The real one; can be told to make a mistake at its n-th exchange."""

    options = Settings(
        SerialDriven.options.fields, fail_at=integer(default=0), how=text()
    )
    count = 0

    def exchange(self, command: DefDict) -> Any:
        self.count += 1
        self.seen = command
        if self.count == self.options.fail_at:
            return self.fail(command)
        return readings(self.count, self.ask(request(self.count, command)))

    def fail(self, command: DefDict) -> Any:
        match self.options.how:
            case "exception":
                raise ZeroDivisionError("wheels fell off")
            case "list":
                return [1.0]
            case "port":
                return {"stat": {"x": 1.0}}
            case "field":
                return {"state": {"xx": 1.0}}
            case "exit":
                raise SystemExit(3)
        return None


class BareCart(Driven):
    """Reads and writes the terminal as it is: nothing of it ever times out."""

    options = Settings(port=text(), padding=integer(default=0))
    file: int | None = None
    count = 0

    def connect(self) -> None:
        self.file = os.open(self.options.port, os.O_RDWR | os.O_NOCTTY)

    def disconnect(self) -> None:
        if self.file is not None:
            os.close(self.file)
            self.file = None

    def exchange(self, command: DefDict) -> Any:
        assert self.file is not None
        self.count += 1
        os.write(self.file, b"\n" * self.options.padding + request(self.count, command))
        reply = b""
        while not reply.endswith(b"\n"):
            reply += os.read(self.file, 1)
        return readings(self.count, reply)


class Ahead(Input):
    """Says that it goes ahead."""

    options = Settings(speed=number(default=0.5), fail_at=integer(default=0))
    value = Out(COMMAND)

    def read(self, tick: Tick) -> dict[str, float]:
        if tick.n == self.options.fail_at:
            raise RuntimeError("the stick broke")
        return {"speed": self.options.speed, "turn": math.sin(tick.t)}
