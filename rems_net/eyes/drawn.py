"""Markers as cells, of every family."""

from collections.abc import Set

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
    family: str, grey: NDArray[np.uint8], missing: Set[int] = frozenset()
) -> list[tuple[int, NDArray[np.float64]]]:
    """Return the id of each marker in a picture, and its corners (4, 2), pixels.

    The corners begin at the lower left of a marker, and go on to the lower right.
    missing: ids that are searched a second time if they are not found at once
    """
    if family == ARUCO:
        return opencv.found(grey)
    seen = apriltags.found(family, grey)
    if missing := missing - {number for number, _ in seen}:
        again = apriltags.found(family, grey, blurred=True)
        seen += [one for one in again if one[0] in missing]
    return seen
