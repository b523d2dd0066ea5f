"""Devices: what a robot's motors and sensors are called in a simulator's own model.

A simulator such as Webots brings models of robots, each with a frame and with names of
its own. A definition says how they go with its fields, in a method:

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

    device: its name there      command: path of the field; several may obey one
    A field in rad/s or m/s is its speed, one in rad or m where it goes; it is told
    factor * field + offset.
    pace: path of the field that says how fast it goes there, as a share of `top`,
        rad/s or m/s; "" for as fast as it can
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

    field: its path in `port`      device: its name there
    part: 0, 1 or 2 of a device that measures a vector; None of one with one number
    The field is factor * number + offset; yes, where it is yes or no, above 0.5.
    counted: factor times what has been added since the robot was put where it started
    table: pairs of number and field, with straight lines between, in place of factor
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
    """Motors and readings of a model, and how its frame lies.

    origin: of the definition, in the model's frame, m
    ahead: the definition's +x in the model's frame
    """

    motors: tuple[Motor, ...]
    readings: tuple[Reading, ...] = ()
    origin: Vector = (0.0, 0.0, 0.0)
    ahead: Vector = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_length(self.ahead)


@runtime_checkable
class InWebots(Protocol):
    """A definition that says what its devices are called in Webots."""

    def webots(self) -> Devices:
        """Return its devices there."""


def two_sides(left: Iterable[str], right: Iterable[str]) -> tuple[Motor, ...]:
    """Return the motors of a robot whose wheels turn as one on each side."""
    return tuple(
        Motor(device, f"wheel/{side}")
        for side, devices in (("left", left), ("right", right))
        for device in devices
    )


def encoders(left: str, right: str) -> tuple[Reading, ...]:
    """Return what two position sensors tell: the encoders, and the wheels' angles."""
    return tuple(
        reading
        for side, device in (("left", left), ("right", right))
        for reading in (
            Reading(f"encoder/{side}", device, counted=True),
            Reading(f"wheel/{side}", device, counted=True, port="state"),
        )
    )
