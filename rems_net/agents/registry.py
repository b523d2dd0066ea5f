"""Names for classes: the built-in ones, and a user's own by file or module."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from rems_net.agents.diagnosis import describe
from rems_net.errors import ExperimentError, MissingPartError, RemsError, nearest

#: kind -> name -> where it is; text, so that nothing is imported before it is used
BUILT_IN: dict[str, dict[str, str]] = {
    "input": {"csv": "rems_net.inputs.csv:CsvInput"},
    "output": {"csv": "rems_net.outputs.csv:CsvOutput"},
    "process": {},
    "definition": {"woodbot": "rems_net.robots.woodbot:Woodbot"},
    "driver": {
        "kinematic": "rems_net.drivers.kinematic.kinematic:Kinematic",
        "mujoco": "rems_net.drivers.physics.mujoco:Mujoco",
        "pybullet": "rems_net.drivers.physics.pybullet:Pybullet",
    },
}

_loading: list[Path] = []


class ScriptEnd(BaseException):
    """Raised where a user's script, loaded in a host, would run its experiment.

    What the script defines before that line is all a host needs, so a script needs no
    `if __name__ == "__main__":`.
    """


def loading() -> bool:
    """Whether this process is loading a script for its classes only."""
    return bool(_loading)


def find(kind: str, name: str | type, folder: Path) -> type:
    """The class that `name` means: built in, `file.py:Class` or `module:Class`.

    folder: where a relative file is looked for. Raises ExperimentError.
    """
    if isinstance(name, type):
        return name
    if ":" in name:
        return load(name, folder)
    known = BUILT_IN[kind]
    if name not in known:
        have = ", ".join(known) or "none built in"
        raise ExperimentError(
            f"There is no {kind} {name!r}; there is {have}, or your own as "
            f"'my_file.py:MyClass'.{nearest(name, known)}"
        )
    return load(known[name], folder)


def load(reference: str, folder: Path) -> type:
    """Import `module:Class` or `file.py:Class`. Raises ExperimentError."""
    where, _, qualname = reference.rpartition(":")
    if where.endswith(".py"):
        module = load_file((folder / where).resolve())
    else:
        try:
            module = importlib.import_module(where)
        except MissingPartError:
            raise
        except ImportError as error:
            raise ExperimentError(f"Cannot import {where!r}: {error}.") from None
    found: object = module
    for part in qualname.split("."):
        found = getattr(found, part, None)
    if not isinstance(found, type):
        classes = [k for k, v in vars(module).items() if isinstance(v, type)]
        raise ExperimentError(
            f"{where} has no class {qualname!r}.{nearest(qualname, classes)}"
        )
    return found


def load_file(path: Path) -> ModuleType:
    """Run a user's file for the classes it defines; once per process."""
    # Without a dot, or pickle would look for a package of what comes before it.
    name = f"rems_script:{path}".replace(".", "%2E")
    if name in sys.modules:
        return sys.modules[name]
    if not path.is_file():
        raise ExperimentError(f"There is no file {path}.")
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    sys.path.insert(0, str(path.parent))
    _loading.append(path)
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), module.__dict__)
    except ScriptEnd:
        pass
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, SyntaxError):
            sentence = f"{error.filename}, line {error.lineno}: {error.msg}."
            raise ExperimentError(sentence) from None
        if isinstance(error, RemsError | KeyboardInterrupt):
            raise
        raise ExperimentError(describe(error)) from error
    finally:
        _loading.pop()
    return module


def loaded_files() -> list[Path]:
    """The users' files that this process has loaded, in order."""
    modules = [m for n, m in sys.modules.items() if n.startswith("rems_script:")]
    return [Path(str(module.__file__)) for module in modules]


def reference(cls: type) -> str:
    """What `load` needs to find this class again in another process.

    Raises ExperimentError for a class that another process cannot reach.
    """
    module = sys.modules.get(cls.__module__)
    path = None
    if cls.__module__ == "__main__" or cls.__module__.startswith("rems_script:"):
        path = getattr(module, "__file__", None)
        if path is None:
            raise ExperimentError(
                f"{cls.__name__} was typed into an interactive session, where the "
                "process of its agent cannot find it; put it into a .py file."
            )
    if "<locals>" in cls.__qualname__:
        raise ExperimentError(
            f"{cls.__qualname__} is defined inside a function, where the process of "
            "its agent cannot find it; define it at the top of the file."
        )
    where = cls.__module__ if path is None else str(Path(path).resolve())
    return f"{where}:{cls.__qualname__}"
