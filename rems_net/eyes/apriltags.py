"""AprilTags: their pictures, and their corners in a picture."""

import ctypes
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.libraries import load

#: px. Blur of a softer picture. A marker in a hundred is found in one of the two only.
SOFT = 0.8
#: Wrong bits that are mended. With 1, one random pattern in a million is a marker.
MENDED = 0
#: Contrast of bits below which a finding is clutter, in levels of brightness.
FAINT = 8.0


@cache
def _detector(family: str, blur: float) -> Any:
    return _module().apriltag(family, blur=blur, maxhamming=MENDED)


@cache
def _module() -> Any:
    # Without OpenCV it prints advice about a function that nothing here calls.
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        return load("apriltag", "camera")


def found(
    family: str, grey: NDArray[np.uint8], *, blurred: bool = False
) -> list[tuple[int, NDArray[Any]]]:
    """Return the id of each marker in a picture, and its corners (4, 2), pixels.

    The corners begin at the lower left, and go on to the lower right.
    blurred: whether edges are searched in a softer picture, which shows others
    """
    return [
        # The library's origin is the picture's corner, half a pixel from a middle.
        (int(one["id"]), np.asarray(one["lb-rb-rt-lt"]) - 0.5)
        for one in _detector(family, SOFT if blurred else 0.0).detect(grey)
        if one["margin"] >= FAINT
    ]


class _Image(ctypes.Structure):
    """The library's picture of one byte a pixel."""

    _fields_ = (
        ("width", ctypes.c_int32),
        ("height", ctypes.c_int32),
        ("stride", ctypes.c_int32),
        ("pixels", ctypes.POINTER(ctypes.c_uint8)),
    )


@cache
def cells(family: str, number: int) -> NDArray[np.uint8]:
    """Return a marker's cells, 0 for black and 1 for white, with its white ring."""
    library = _library()
    make = getattr(library, f"{family}_create")
    make.restype = ctypes.c_void_p
    draw = library.apriltag_to_image
    draw.argtypes = [ctypes.c_void_p, ctypes.c_uint32]
    draw.restype = ctypes.POINTER(_Image)
    drawn = draw(make(), number).contents
    flat = np.ctypeslib.as_array(drawn.pixels, (drawn.height, drawn.stride))
    return (flat[:, : drawn.width] > 127).astype(np.uint8)


@cache
def _library() -> Any:
    """Return the C library beside the module, which Python's module does not show."""
    folder = Path(_module().__file__).parent
    beside = [*folder.glob("*apriltag*"), *folder.parent.glob("apriltag*.libs/*")]
    for path in sorted(beside):
        if path.suffix in (".so", ".dylib", ".dll", ".pyd"):
            library = ctypes.CDLL(str(path))
            if hasattr(library, "apriltag_to_image"):
                return library
    raise OSError("the library apriltag is here without its pictures")
