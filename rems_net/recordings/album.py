"""An album: what one camera of a run saw, from the PNG files that were kept."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rems_net.errors import ExperimentError, UnknownFieldError, nearest, some
from rems_net.pictures import pixels
from rems_net.reading import MESH, read_file


class Album(Mapping[int, NDArray[np.uint8]]):
    """Pictures (height, width, 3) of red, green and blue, by the tick that they end.

    Each is read when it is asked for.
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
        """One picture. Raises KeyError; ExperimentError for one that no run wrote."""
        path = self._files[tick]
        try:
            return pixels(read_file(path, MESH))
        except (OSError, ValueError):
            raise ExperimentError(
                f"{path} is no picture that a run has kept."
            ) from None

    def __repr__(self) -> str:
        return f"<{len(self)} pictures in {self.folder}>"


def album_of(folder: Path, camera: str) -> Album:
    """The pictures of a camera, such as "bot.camera". Raises UnknownFieldError."""
    names = [path.name for path in folder.iterdir() if any(path.glob("*.png"))]
    if camera not in names:
        have = (
            some(sorted(names))
            if names
            else "none; an output of type pictures keeps them"
        )
        raise UnknownFieldError(
            f"there are no pictures of {camera!r} in {folder}; there is {have}."
            f"{nearest(camera, names)}"
        )
    return Album(folder / camera)
