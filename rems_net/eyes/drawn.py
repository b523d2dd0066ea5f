"""Markers as cells, of every family."""

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.marker import Marker
from rems_net.eyes import apriltags, opencv

ARUCO = "aruco4x4"


def cells(marker: Marker) -> NDArray[np.uint8]:
    """Return a marker's cells, top row first: 0 for black, 1 for white.

    A ring of white cells is around its black square.
    """
    if marker.family == ARUCO:
        return opencv.cells(marker.id)
    return apriltags.cells(marker.family, marker.id)


def found(
    family: str, grey: NDArray[np.uint8]
) -> list[tuple[int, NDArray[np.float64]]]:
    """Return the id of each marker in a picture, and its corners (4, 2), pixels.

    The corners begin at the lower left of a marker, and go on to the lower right.
    """
    if family == ARUCO:
        return opencv.found(grey)
    return apriltags.found(family, grey)
