"""OpenCV: ArUco markers, webcams and lenses; nothing else imports it."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.lens import Lens
from rems_net.errors import SchemaError
from rems_net.libraries import load

#: px of a side of the windows in which a corner is refined
WINDOW = 5
#: Share of wrong cells that are mended.
MENDED = 0.0
#: Pictures of a board that a lens needs: with fewer, fx and the distance cannot be
#: parted.
BOARDS = 5
#: degrees between the pictures' views of a board; with less, the same holds.
SIDES = 20.0


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
    about.errorCorrectionRate = about.maxErroneousBitsInBorderRate = MENDED
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


class Webcam:
    """An open webcam, or a film in its place, that gives pictures of one size.

    source: the number of a webcam, from 0; or a film's path, or that of pictures such
        as `shot-%03d.png`
    Raises OSError for none, or one of another size.
    """

    #: the picture that was read to try it, until it is asked for
    _first: NDArray[np.uint8] | None = None

    def __init__(self, source: int | str, width: int, height: int):
        cv = _cv()
        log = cv.utils.logging
        log.setLogLevel(log.LOG_LEVEL_SILENT)  # it would write to the terminal
        self._device = cv.VideoCapture(source)
        name = f"film {source}" if isinstance(source, str) else f"webcam {source}"
        if not self._device.isOpened():
            raise OSError(f"no {name} opens")
        self._size = (width, height)
        if not isinstance(source, str):
            self._device.set(
                cv.CAP_PROP_BUFFERSIZE, 1
            )  # old pictures count for nothing
            self._device.set(cv.CAP_PROP_FRAME_WIDTH, width)
            self._device.set(cv.CAP_PROP_FRAME_HEIGHT, height)
        try:
            self._first = self.read()
            if self._first is None:
                raise OSError(f"{name} opens and gives no picture")
        except OSError:
            self.close()
            raise

    def read(self) -> NDArray[np.uint8] | None:
        """Return the next picture (height, width, 3), or None if none came.

        Raises OSError for a picture of another size.
        """
        if (first := self._first) is not None:
            self._first = None
            return first
        good, picture = self._device.read()
        if not good:
            return None
        height, width = picture.shape[:2]
        if (width, height) != self._size:
            raise OSError(
                f"it gives pictures of {width} x {height}, and {self._size[0]} x "
                f"{self._size[1]} are asked for; write width = {width} and height = "
                f"{height}, with the lens of that size"
            )
        turned: NDArray[np.uint8] = picture[:, :, ::-1]  # OpenCV has blue first
        return turned

    def close(self) -> None:
        """Give the webcam back."""
        self._device.release()


def grey_file(path: Path) -> NDArray[np.uint8] | None:
    """Return the picture of a file without its colours, or None if it is none."""
    cv = _cv()
    read: NDArray[np.uint8] | None = cv.imread(str(path), cv.IMREAD_GRAYSCALE)
    return read


def lens_of_board(
    pictures: Sequence[NDArray[np.uint8]], columns: int, rows: int
) -> tuple[Lens, float]:
    """Return the lens that has seen a chessboard, and its deviation, px.

    pictures: grey, (height, width)      columns, rows: of the inner corners
    Raises SchemaError if fewer than 5 pictures show the whole board, or all show it
    from one side.
    """
    cv = _cv()
    board = np.zeros((columns * rows, 3), np.float32)
    board[:, :2] = np.mgrid[:columns, :rows].T.reshape(-1, 2)
    seen = []
    for grey in pictures:
        good, corners = cv.findChessboardCornersSB(grey, (columns, rows))
        if good:
            seen.append(corners.reshape(-1, 1, 2))
    if len(seen) < BOARDS:
        raise SchemaError(
            f"{len(seen)} of {len(pictures)} pictures show a board of {columns} by "
            f"{rows} inner corners; take {BOARDS} and more, the whole board in each, "
            "from several sides. (R1107)"
        )
    height, width = pictures[0].shape
    left, matrix, bends, turns, _ = cv.calibrateCamera(
        [board] * len(seen), seen, (width, height), None, None
    )
    across = np.array([cv.Rodrigues(turn)[0][:, 2] for turn in turns])
    apart = float(np.degrees(np.arccos(np.clip(across @ across.T, -1, 1).min())))
    if apart < SIDES:
        raise SchemaError(
            f"all pictures show the board from one side, within {apart:.0f} degrees; "
            f"tilt it by {SIDES:.0f} and more, to several sides. (R1107)"
        )
    fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    five = tuple(float(one) for one in bends.ravel()[:5])
    return Lens(width, height, fx, fy, cx, cy, five), float(left)
