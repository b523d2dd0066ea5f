"""Camera: an eye on a tripod, without a motor, by which other robots are found."""

from collections.abc import Mapping
from math import radians
from typing import Any, ClassVar

import numpy as np

from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Definition
from rems_net.bodies.body import Body, Part, Sphere
from rems_net.bodies.lens import BENDS, Lens
from rems_net.bodies.noise import Noise
from rems_net.bodies.sensors import Camera as Eye
from rems_net.defdict import DefDict, Schema, angle, array, integer, length, number
from rems_net.eyes.view import turn_of

#: a tripod that touches nothing, and weighs something, as every body does
TRIPOD = (Part(Sphere(0.01), 1.0, friction=None),)

LENS = Schema(
    "lens",
    {
        "fx": number(doc="pixels for a slope of 1, to the right"),
        "fy": number(doc="pixels for a slope of 1, down"),
        "cx": number(doc="pixel of the axis; the upper left one is 0"),
        "cy": number(doc="pixel of the axis; the upper left one is 0"),
        "bends": array(BENDS, doc="distortion: k1, k2, p1, p2, k3, as OpenCV's"),
    },
)
PLACE = Schema(
    "place",
    {
        "x": length("m"),
        "y": length("m"),
        "z": length("m", default=1.0),
        "heading": angle("rad", doc="of its view; if it looks down, of the top"),
        "pitch": angle("rad", default=-radians(90), doc="of its view, up is plus"),
        "roll": angle("rad", doc="about its view"),
    },
)


def _sensors(p: DefDict) -> Schema:
    picture = array((p["height"], p["width"], 3), dtype="u1")
    tick = integer(doc="of the picture; 0 for the one of the start")
    return Schema(
        "camera.sensors",
        {"picture": picture, "tick": tick, "lens": LENS, "place": PLACE},
    )


class Camera(Definition):
    """A camera that stands still. Its sensors are picture, tick, lens and place.

    The lens has a field of view, or fx, fy, cx and cy as OpenCV computes them.
    """

    parameters = Settings(
        {
            "width": integer(default=640, range=(16, 4096), doc="pixels"),
            "height": integer(default=480, range=(16, 4096), doc="pixels"),
            "field_of_view": angle(
                default=radians(60), range=(0.02, 2.8), doc="left to right, without fx"
            ),
            "fx": number(range=(0, 1e5), doc="pixels; 0: by the field of view"),
            "fy": number(range=(0, 1e5), doc="pixels; 0: as fx"),
            "cx": number(default=-1.0, range=(-1, 4096), doc="pixels; -1: the middle"),
            "cy": number(default=-1.0, range=(-1, 4096), doc="pixels; -1: the middle"),
            "bends": array(BENDS, doc="distortion: k1, k2, p1, p2, k3, as OpenCV's"),
            "place": PLACE,
            "every": integer(default=1, range=(1, 10_000), doc="steps for a picture"),
            "blur": number(range=(0, 10), doc="of the chip, pixels, with noise"),
            "grain": number(range=(0, 100), doc="of the chip, of 255, with noise"),
        }
    )
    obeys: ClassVar[bool] = False
    by_picture: ClassVar[bool] = True
    command = In(Schema("camera.command", {}))
    state = Out(Schema("camera.state", {}))
    sensors = Out(_sensors)

    def lens(self) -> Lens:
        """Return its lens. Raises SchemaError for one that cannot be."""
        p = self.parameters
        width, height = p["width"], p["height"]
        bends = tuple(p["bends"].tolist())
        usual = Lens.seeing(width, height, p["field_of_view"])
        fx = p["fx"] or usual.fx
        cx = usual.cx if p["cx"] < 0 else p["cx"]
        cy = usual.cy if p["cy"] < 0 else p["cy"]
        return Lens(width, height, fx, p["fy"] or fx, cx, cy, bends)

    def body(self) -> Body:
        """Return a point at the origin with a camera at its place."""
        p, lens = self.parameters, self.lens()
        place = p["place"]
        turn = turn_of(place["heading"], place["pitch"], place["roll"])
        ahead, _, top = turn.T.tolist()
        at = (p["place/x"], p["place/y"], p["place/z"])
        eye = Eye(
            "picture",
            at,
            tuple(ahead),
            lens.width,
            lens.height,
            p["field_of_view"],
            every=p["every"],
            lens=lens,
            top=tuple(top),
            blur=p["blur"],
            grain=p["grain"],
            stamp="tick",
        )
        return Body(TRIPOD, sensors=(eye,), fixed=True)

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, float]:
        """Return nothing: it stands still."""
        return {}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        """Return lens and place; only physics draws the picture."""
        return self.still()

    def noise(self) -> Mapping[str, Noise]:
        """Return no noise of numbers: blur and grain are of the picture."""
        return {}

    def still(self) -> dict[str, Any]:
        """Return the sensors that never change, by path: lens and place."""
        p, lens = self.parameters, self.lens()
        four = {f"lens/{one}": getattr(lens, one) for one in ("fx", "fy", "cx", "cy")}
        place = {f"place/{path}": p[f"place/{path}"] for path in PLACE.paths}
        return {**four, "lens/bends": np.array(lens.bends), **place}

    def rewind(self) -> None:
        """Start again; lens and place are in the sensors from the start."""
        super().rewind()
        self.sensors = self.still()
