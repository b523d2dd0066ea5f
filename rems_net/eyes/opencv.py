"""OpenCV: ArUco markers, webcams and lenses; nothing else imports it."""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.libraries import load

#: px of a side of the windows in which a corner is refined
WINDOW = 5


@cache
def _cv() -> Any:
    return load("cv2", "camera")


@cache
def _dictionary() -> Any:
    aruco = _cv().aruco
    return aruco.getPredefinedDictionary(aruco.DICT_4X4_50)


@cache
def _detector() -> Any:
    aruco = _cv().aruco
    about = aruco.DetectorParameters()
    about.cornerRefinementMethod = aruco.CORNER_REFINE_SUBPIX
    about.cornerRefinementWinSize = WINDOW
    return aruco.ArucoDetector(_dictionary(), about)


def cells(number: int) -> NDArray[np.uint8]:
    """Return a 4x4 marker's cells, 0 for black and 1 for white, with its white ring."""
    drawn = _cv().aruco.generateImageMarker(_dictionary(), number, 6)
    return np.pad((drawn > 127).astype(np.uint8), 1, constant_values=1)


def found(grey: NDArray[np.uint8]) -> list[tuple[int, NDArray[np.float64]]]:
    """Return the id of each 4x4 marker in a picture, and its corners (4, 2), pixels."""
    corners, ids, _ = _detector().detectMarkers(grey)
    if ids is None:
        return []
    # OpenCV begins at the upper left, and goes on to the upper right.
    order = [3, 2, 1, 0]
    return [
        (int(number), np.asarray(four, float).reshape(4, 2)[order])
        for number, four in zip(ids.ravel(), corners, strict=True)
    ]
