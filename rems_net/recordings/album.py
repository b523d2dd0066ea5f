"""Album: the pictures of one camera of a run, from its PNG files."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some
from rems_net.pictures import pixels
from rems_net.system.reading import MESH, read_file


class Album(Mapping[int, NDArray[np.uint8]]):
    """Pictures (height, width, 3) of red, green and blue, by tick: the end of the step.

    Each is read on request.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        found = (path for path in folder.glob("*.png") if path.stem.isdecimal())
        self._files = dict(sorted((int(path.stem), path) for path in found))

    def __iter__(self) -> Iterator[int]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)

    def __getitem__(self, tick: int) -> NDArray[np.uint8]:
        """Return one picture. Raises KeyError; ExperimentError for a foreign file."""
        path = self._files[tick]
        try:
            return pixels(read_file(path, MESH))
        except (OSError, ValueError):
            raise ExperimentError(
                f"{path} is no picture that a run has kept; "
                "copy it once more, or remove it. (R0805)"
            ) from None

    def __repr__(self) -> str:
        return f"<{len(self)} pictures in {self.folder}>"


def album_of(folder: Path, camera: str) -> Album:
    """Return a camera's pictures, such as "bot.camera". Raises UnknownFieldError."""
    names = [path.name for path in folder.iterdir() if any(path.glob("*.png"))]
    if camera not in names:
        have = (
            some(sorted(names))
            if names
            else "none; an output of type pictures keeps them"
        )
        raise UnknownFieldError(
            f"there are no pictures of {camera!r} in {folder}; there is {have}."
            f"{nearest(camera, names)} (R0841)"
        )
    return Album(folder / camera)
