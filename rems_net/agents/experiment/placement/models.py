"""Models: file names inside the received files of a robot or a world.

A MJCF or a URDF names meshes, textures and further files, and MuJoCo opens them by
itself. So each such name must stay in the folder of the received files.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import PurePosixPath
from posixpath import normpath
from xml.etree import ElementTree

from rems_net.agents.experiment.placement.offered import leads_out
from rems_net.errors import ExperimentError

#: Start of a declaration of entities, which readers of XML replace in different ways.
_DECLARED = re.compile(rb"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
#: lines of an OBJ that name another file
_OBJ = re.compile(rb"(?mi)^[ \t]*(mtllib|map_\w+|call)[ \t]+(.*?)[ \t\r]*$")


def check_models(files: Mapping[str, bytes]) -> None:
    """Raise ExperimentError for a file whose names lead out of their folder."""
    models = {n: d for n, d in files.items() if n.lower().endswith((".xml", ".urdf"))}
    # Names in an included file are relative to the folder of the including file.
    depth = min((len(PurePosixPath(name).parents) - 1 for name in models), default=0)
    for name, data in files.items():
        up = 0
        if name in models:
            named = list(_named(name, data))
            up = max((_up(one) for is_folder, one in named if is_folder), default=0)
        elif name.lower().endswith(".obj"):
            named = [(False, m[2].decode("latin-1")) for m in _OBJ.finditer(data)]
        else:
            continue
        for is_folder, one in named:
            parts = [part for part in one.split("/") if part not in ("..", ".")]
            out = (
                leads_out("/".join(parts))
                or _up(one) + (0 if is_folder else up) > depth
            )
            if out and not _of_package(one, name, files):
                raise ExperimentError(
                    f"{name} names {one!r:.80}, which is not below the folder of what "
                    "came; write names of files that are beside it. (R0440)"
                )


def _named(name: str, data: bytes) -> Iterator[tuple[bool, str]]:
    """Yield each file and each folder that a model names; True for a folder."""
    if _DECLARED.search(data):
        raise ExperimentError(
            f"{name} declares entities or a DOCTYPE; leave them out. (R0440)"
        )
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError):
        raise ExperimentError(f"{name} is no XML. (R0440)") from None
    for element in root.iter():
        for word, value in element.attrib.items():
            if "file" in word.lower():
                yield False, value
            elif word.lower().endswith("dir") and word != "dir":  # that of a light
                yield True, value


def _of_package(one: str, model: str, files: Mapping[str, bytes]) -> bool:
    """Return whether `package://robot/arm.stl` is among the files, searched first."""
    scheme, _, rest = one.partition("://")
    package, _, inside = rest.partition("/")
    places = [(above, rest) for above in PurePosixPath(model).parents]
    places += [(above, inside) for above, _ in places if above.name == package]
    return scheme == "package" and any((a / b).as_posix() in files for a, b in places)


def _up(name: str) -> int:
    """Return how many folders a relative name goes up, at its highest."""
    return normpath(name).split("/").count("..")
