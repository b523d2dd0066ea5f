"""PicturesOutput: what cameras see, a PNG file per camera and tick."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Output
from rems_net.agents.ports import In
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema
from rems_net.events import warn
from rems_net.outputs.refused import failed, taken
from rems_net.pictures import album, is_picture, png
from rems_net.system.patience import patiently

#: where a picture is put together; it gets its name when it is whole
PART = "picture.part"


class PicturesOutput(Output):
    """Writes `<robot>.<camera>/000042.png`: what was seen at the end of tick 42.

    Of all robots it reads, every robot by default; at every n-th tick with
    `every = n`. A picture is an array of u1, (height, width, 3), as a camera fills it.
    A run that is killed leaves whole pictures. Started again after a crash, it goes on.
    """

    robots = In(source="robot/*/*")

    def open(self) -> None:
        """Have no folder yet: who has a camera is known at the first tick."""
        self._folders: dict[str, Path] = {}
        self._told = False

    def write(self, tick: Tick) -> None:
        """Add a picture to each camera's folder."""
        values: Any = self.robots
        for key, value in values.items():
            for path, name in _albums(key, value.schema):
                folder = self._folder(name)
                self._keep(folder, f"{tick.n:06d}.png", png(value[path]))
        if not self._folders and not self._told:
            self._told = True
            heard = ", ".join(values) or "nobody"
            text = f"{self.key}: there is no picture to keep; it reads {heard}"
            warn("unset", text, self.key)

    def _folder(self, name: str) -> Path:
        if name not in self._folders:
            path = self.out / name
            try:
                path.mkdir(exist_ok=bool(self.restarts))
            except FileExistsError:
                raise taken(self.key, path) from None
            except OSError as error:
                raise failed(self.key, path, error) from None
            self._folders[name] = path
        return self._folders[name]

    def _keep(self, folder: Path, name: str, picture: bytes) -> None:
        part = folder / PART
        try:
            part.write_bytes(picture)
            patiently(lambda: part.replace(folder / name))
        except OSError as error:
            part.unlink(missing_ok=True)
            raise failed(self.key, folder / name, error) from None

    def expected(self, ports: Mapping[str, Schema]) -> list[str]:
        """Return the folders."""
        every = (_albums(key, schema) for key, schema in ports.items())
        return [name for albums in every for _, name in albums]

    def made(self) -> list[Path]:
        """Return the folders, in the order in which the cameras were met."""
        return [*self._folders.values()]


def _albums(key: str, schema: Schema) -> Iterator[tuple[str, str]]:
    """Yield the path of each picture of a port, and the folder that it goes to."""
    _, robot, port = key.split("/")
    for path, field in schema.rows():
        if is_picture(field):
            yield path, album(robot, port, path)
