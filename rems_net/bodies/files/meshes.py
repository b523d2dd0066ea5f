"""Meshes: finds and reads the mesh files that a robot's file names."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.bodies.parts import Array
from rems_net.errors import SchemaError
from rems_net.system.reading import MESH, read_file

#: A binary STL: a header of any bytes, the number of triangles, and the triangles.
HEAD, COUNT = 80, 4
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("own", "<u2")])
_CORNER = {
    ".stl": rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)",
    ".obj": rb"(?m)^[ \t]*v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)",
}


def find_mesh(named: str, file: Path, packages: str | Path | None) -> Path:
    """Return the path of a mesh. Raises SchemaError.

    file: the robot's file      packages: folder that contains ROS packages
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
        f"{advice}. (R0211)"
    )


def mesh_file(path: Path) -> bytes:
    """Return the bytes of a mesh. Raises SchemaError for a file that can't be one."""
    try:
        return read_file(path, MESH)
    except OSError as error:
        raise SchemaError(
            f"cannot read the mesh {path}: {error.strerror}. (R0201)"
        ) from None


def corners(path: Path) -> Array | None:
    """Return the corners (n, 3) of an STL or an OBJ, m before it is scaled.

    None for a format that we cannot read. Raises SchemaError if it is no mesh.
    """
    data, kind = mesh_file(path), path.suffix.lower()
    if kind not in _CORNER:
        return None
    triangles = _binary(data) if kind == ".stl" else None
    try:
        if triangles is None:
            points = np.array(re.findall(_CORNER[kind], data), float).reshape(-1, 3)
        else:
            points = triangles["corners"].reshape(-1, 3).astype(float)
    except ValueError:
        points = np.zeros((0, 3))
    if not len(points) or not np.isfinite(points).all():
        raise SchemaError(
            f"{path} is no {kind[1:].upper()} with corners that are numbers: save it "
            "anew from where it was made. (R0211)"
        )
    return points


def made_binary(path: Path) -> bytes | None:
    """Return an STL that is text, or too long, in the binary format of the engines.

    None for other files.
    """
    if path.suffix.lower() != ".stl":
        return None
    data = mesh_file(path)
    triangles = _binary(data)
    if triangles is None:
        points = corners(path)
        assert points is not None
        triangles = np.zeros(len(points) // 3, _TRIANGLE)
        triangles["corners"] = points[: 3 * len(triangles)].reshape(-1, 3, 3)
    count = len(triangles).to_bytes(COUNT, "little")
    made = bytes(HEAD) + count + triangles.tobytes()
    return None if len(made) == len(data) else made


def _binary(data: bytes) -> Any:
    """Return the triangles (n,) of a binary STL; None for one that is text.

    The bytes of the count, if they are text, are a number too large for any file.
    """
    count = int.from_bytes(data[HEAD : HEAD + COUNT], "little")
    if not 0 < count <= (len(data) - HEAD - COUNT) // _TRIANGLE.itemsize:
        return None
    return np.frombuffer(data, _TRIANGLE, count, HEAD + COUNT)


def _places(named: str, folder: Path, packages: str | Path | None) -> Iterator[Path]:
    scheme, found, rest = named.partition("://")
    if not found:
        yield folder / named
        return
    if scheme == "file":
        yield Path(rest[1:] if rest[2:3] == ":" else rest)  # /C:/robots/arm.stl
        return
    rest = rest.lstrip("/")
    package, _, inside = rest.partition("/")
    if packages is not None:
        yield folder / packages / rest
        yield folder / packages / inside
        return
    folders = (folder, *folder.resolve().parents)
    for above in folders:
        if above.name == package:
            yield above / inside
        yield above / rest
    for above in folders:  # the package's folder was renamed, as after a ZIP file
        yield above / inside
