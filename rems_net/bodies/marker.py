"""Marker: a printed square by which a camera finds a robot or a thing."""

from dataclasses import dataclass

from rems_net.bodies.parts import Vector
from rems_net.errors import SchemaError

#: family -> number of its ids, and cells of its picture along an edge: AprilTag 3, and
#: OpenCV's 4x4_50. Its black square is `size`; a ring of white cells is around that.
FAMILIES = {"tag36h11": (587, 8), "tag25h9": (35, 7), "aruco4x4": (50, 6)}


@dataclass(frozen=True, slots=True)
class Marker:
    """A square marker that lies level, face up.

    family: of its picture, one of FAMILIES      id: its number in the family
    size: edge of its black square, m
    at: its middle, in the frame of its robot or thing, m
    heading: of its upper edge's direction, from its robot's or thing's x, rad
    """

    family: str
    id: int
    size: float
    at: Vector = (0.0, 0.0, 0.0)
    heading: float = 0.0

    def __post_init__(self) -> None:
        ids, _ = FAMILIES[self.family]
        if not 0 <= self.id < ids:
            raise SchemaError(
                f"{self.family} has markers 0 to {ids - 1}; got id = {self.id}. (R1102)"
            )
        if not self.size > 0:
            raise SchemaError(
                'A marker has a size, the edge of its black square, such as "40 mm"; '
                f"got {self.size:g} m. (R1102)"
            )

    @property
    def cells(self) -> int:
        """Number of cells along the edge of its black square."""
        return FAMILIES[self.family][1]

    @property
    def paper(self) -> float:
        """Edge of the paper: the black square, and a white cell on each side, m."""
        return self.size * (self.cells + 2) / self.cells
