"""Devices: names of a robot's motors and sensors in a simulator's own model.

A simulator such as Webots has models of robots, each with its own frame and names. A
definition maps them to its fields, in a method:

    def webots(self) -> Devices:
        return Devices(
            motors=(Motor("left wheel", "wheel/left"), ...),
            readings=(Reading("sonar/0", "so0", factor=-5 / 1024, offset=5.0), ...),
        )
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from rems_net.bodies.parts import Vector, check_length


@dataclass(frozen=True, slots=True)
class Motor:
    """A motor of the model, and the field of the command that it obeys.

    device: its name in the model    command: path of the field; several may obey one
    A field in rad/s or m/s is the motor's speed, one in rad or m its position; the
    motor's target is factor * field + offset.
    pace: path of the field for the speed of that motion, as a share of `top`, rad/s
        or m/s; "" for as fast as it can
    """

    device: str
    command: str
    factor: float = 1.0
    offset: float = 0.0
    pace: str = ""
    top: float = 0.0


@dataclass(frozen=True, slots=True)
class Reading:
    """A field that a device of the model measures.

    field: its path in `port`      device: its name in the model
    part: 0, 1 or 2 of a device that measures a vector; None for a single number
    The field is factor * number + offset; a boolean field is true above 0.5.
    counted: the field is its start value, plus factor times the change since then
    table: pairs of number and field, linear in between, in place of factor
    """

    field: str
    device: str
    part: int | None = None
    factor: float = 1.0
    offset: float = 0.0
    counted: bool = False
    table: tuple[tuple[float, float], ...] = ()
    port: Literal["sensors", "state"] = "sensors"


@dataclass(frozen=True, slots=True)
class Devices:
    """Motors and readings of a model, and the place of its frame.

    origin: of the definition's frame, in the model's frame, m
    ahead: the definition's +x axis in the model's frame
    """

    motors: tuple[Motor, ...]
    readings: tuple[Reading, ...] = ()
    origin: Vector = (0.0, 0.0, 0.0)
    ahead: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_length(self.ahead)


@runtime_checkable
class InWebots(Protocol):
    """A definition with the names of its devices in Webots."""

    def webots(self) -> Devices:
        """Return the robot's devices in Webots."""


def two_sides(left: Iterable[str], right: Iterable[str]) -> tuple[Motor, ...]:
    """Return the motors of a robot whose wheels turn together on each side."""
    return tuple(
        Motor(device, f"wheel/{side}")
        for side, devices in (("left", left), ("right", right))
        for device in devices
    )


def encoders(left: str, right: str) -> tuple[Reading, ...]:
    """Return two position sensors' readings: the encoders, and the wheels' angles."""
    return tuple(
        reading
        for side, device in (("left", left), ("right", right))
        for reading in (
            Reading(f"encoder/{side}", device, counted=True),
            Reading(f"wheel/{side}", device, counted=True, port="state"),
        )
    )
