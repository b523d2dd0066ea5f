"""Meshes: the file that a name in a robot's file means, here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rems_net.errors import SchemaError


def find_mesh(named: str, file: Path, packages: str | Path | None) -> Path:
    """Return the path of a mesh. Raises SchemaError.

    file: that names it      packages: the folder in which packages of ROS are
    """
    looked = list(_places(named, file.parent, packages))
    for path in looked:
        if path.is_file():
            return path.resolve()
    where = " or ".join(str(path) for path in looked[:3])
    advice = "Put it there"
    if "://" in named:
        advice += ", or give the Model packages=, the folder that package:// means"
    raise SchemaError(
        f"{file.name} needs the mesh {named}, which would be {where}, and is not. "
        f"{advice}."
    )


def _places(named: str, folder: Path, packages: str | Path | None) -> Iterator[Path]:
    scheme, found, rest = named.partition("://")
    if not found:
        yield folder / named
        return
    if scheme == "file":
        yield Path(rest[1:] if rest[2:3] == ":" else rest)  # /C:/robots/arm.stl
        return
    # What is called a package is a folder of that name, or one that was renamed.
    package, _, inside = rest.partition("/")
    if packages is not None:
        yield folder / packages / rest
        yield folder / packages / inside
        return
    for above in (folder, *folder.resolve().parents):
        if above.name == package:
            yield above / inside
        yield above / rest
    yield folder / inside
    yield folder.parent / inside
