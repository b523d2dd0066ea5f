"""The folder of Webots, and the import of its Python module `controller`."""

import os
import sys
from collections.abc import Mapping
from importlib import import_module, invalidate_caches
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import quote

from rems_net.errors import MissingPartError, SchemaError

HOME, URL = "WEBOTS_HOME", "WEBOTS_CONTROLLER_URL"
MODULE = "controller"
DOWNLOAD = "https://cyberbotics.com"
#: folders into which Webots' installers put it
LINUX = ("/usr/local/webots", "/snap/webots/current/usr/share/webots")
MACOS = ("/Applications/Webots.app", "~/Applications/Webots.app")


def installed(
    environment: Mapping[str, str], system: str = sys.platform
) -> tuple[Path, Path]:
    """Return the folder of Webots on this computer, and that of its Python module.

    Raises MissingPartError if there is none.
    """
    usual = _usual(environment, system)
    given = environment.get(HOME)
    for folder in usual if given is None else [Path(given)]:
        if (python := _python(folder)) is not None:
            return folder, python
    if given is not None:
        raise MissingPartError(
            f"{HOME} is {given!r}, and there is no Webots in that folder (looked for "
            f"lib/controller/python). Set it to where Webots is installed, such as "
            f"{usual[0]}, or unset it. (R0315)"
        )
    raise MissingPartError(
        f"Webots is not installed where it usually is: {', '.join(map(str, usual))}. "
        f"Install it from {DOWNLOAD}, or set {HOME} to its folder. (R0315)"
    )


def _usual(environment: Mapping[str, str], system: str) -> list[Path]:
    if system == "win32":
        roots = [environment.get("PROGRAMFILES", r"C:\Program Files")]
        if "LOCALAPPDATA" in environment:  # folder of an install without admin rights
            roots.append(str(Path(environment["LOCALAPPDATA"]) / "Programs"))
        return [Path(root) / "Webots" for root in roots]
    return [Path(p).expanduser() for p in (MACOS if system == "darwin" else LINUX)]


def _python(folder: Path) -> Path | None:
    """Return the module's folder: for R2023a and later, or for this Python before."""
    version = f"python{sys.version_info.major}{sys.version_info.minor}"
    for inside in (folder / "Contents", folder):
        for name in ("python", version):
            found = inside / "lib" / "controller" / name
            if (found / MODULE).is_dir() or (found / f"{MODULE}.py").is_file():
                return found
    return None


def controller() -> Any:
    """Import Webots' own module `controller`. Raises MissingPartError."""
    folder, python = installed(os.environ)
    _nothing_in_the_way(python)
    os.environ[HOME] = str(folder)
    os.environ.setdefault("PYTHONIOENCODING", "UTF-8")
    if sys.platform == "win32":
        libraries = folder / "msys64" / "mingw64" / "bin"
        os.environ["PATH"] = f"{libraries}{os.pathsep}{os.environ.get('PATH', '')}"
    if str(python) not in sys.path:
        sys.path.append(str(python))
        invalidate_caches()
    try:
        return import_module(MODULE)
    except (ImportError, OSError) as why:
        raise MissingPartError(
            f"Webots is in {folder}, and its Python module cannot be loaded: {why}. "
            "Is it of this computer's kind of processor, and complete? Start Webots "
            f"itself once; install it again from {DOWNLOAD} if that fails, too. (R0302)"
        ) from why


def _nothing_in_the_way(python: Path) -> None:
    """Raise MissingPartError for another module of that name, which would hide it."""
    loaded = sys.modules.get(MODULE)
    if loaded is not None:
        found = getattr(loaded, "__file__", None)
    else:
        spec = find_spec(MODULE)
        if spec is None:
            return
        found = spec.origin
        if found is None:
            return  # a folder without __init__.py, which comes last
    if found is None or not Path(found).resolve().is_relative_to(python.resolve()):
        raise MissingPartError(
            f"{found} is in the way: Webots has a module of the name {MODULE!r}, too, "
            "and Python takes the first one. Give yours another name, or, if pip "
            f"installed it, type: pip uninstall {MODULE} (R0302)"
        )


def url(where: str, robot: str) -> str:
    """Return the URL by which Webots' module finds the robot; "" for the only one.

    where: `tcp://192.168.1.2:1234` or `ipc://1235`; "" for this computer and the
    usual port. Raises SchemaError.
    """
    if where and not where.startswith(("tcp://", "ipc://")):
        raise SchemaError(
            f"url is {where!r}; expected where Webots runs: tcp://192.168.1.2:1234, "
            "ipc://1235 for another port of this computer, or nothing for this "
            "one. (R0309)"
        )
    name = quote(robot, safe="")
    return f"{where.rstrip('/')}/{name}" if where and name else where or name
