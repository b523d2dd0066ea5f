"""Pictures of markers drawn by numpy alone, as a camera straight above sees them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from rems_net import In, Out, Process, Schema, Tick
from rems_net.agents.robot import Driver
from rems_net.bodies.body import Marker
from rems_net.bodies.lens import Lens
from rems_net.defdict import DefDict
from rems_net.eyes.drawn import cells
from rems_net.eyes.view import View, turn_of
from rems_net.units import percent

#: pixels along a cell; and pixels for a metre of the floor: cells of 5 mm
CELL, SCALE = 6, 1200.0
SIZE = 0.04
Grey = NDArray[np.uint8]


def above() -> View:
    """The view of 640 by 480 pixels from 1 m above the markers, along the floor's x."""
    lens = Lens(640, 480, SCALE, SCALE, 319.5, 239.5)
    return View.at(lens, np.array([0, 0, 1.0]), turn_of(0.0, -np.pi / 2, 0.0))


def pasted(
    spots: Iterable[tuple[int, float, float]],
    cell: int = CELL,
    family: str = "tag36h11",
) -> Grey:
    """A grey picture with markers: id, and x and y on the floor, m."""
    picture = np.full((480, 640), 150, np.uint8)
    for number, x, y in spots:
        drawn = np.kron(
            cells(Marker(family, number, SIZE)), np.ones((cell, cell), np.uint8)
        )
        column, row = round(319.5 - SCALE * y), round(239.5 - SCALE * x)
        half = len(drawn) // 2
        place = picture[row - half : row + half, column - half : column + half]
        place[:] = np.where(drawn, 230, 20)
    return picture


class Painted(Driver):
    """A camera's driver that shows pictures one after the other, the last for ever."""

    pictures: tuple[Grey, ...] = ()

    def drive(self, command: DefDict, dt: float) -> None:
        pass

    def sense(self) -> None:
        n = min(self.tick.n, len(self.pictures))
        grey = self.pictures[n - 1]
        self.sensors = {"picture": np.repeat(grey[:, :, None], 3, axis=2), "tick": n}


class Go(Process):
    """Drives ahead for as long as there is a pose."""

    pose = In(source="process/eyes/bot")
    value = Out(Schema("go", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick: Tick) -> None:
        if self.pose.id >= 0:
            self.value = {"wheel": {"left": 50.0, "right": 50.0}}
