"""References to classes: `module:Class` or `file.py:Class`, in every process."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from rems_net.agents.blame import describe
from rems_net.errors import ExperimentError, RemsError, nearest

#: kind -> name -> where it is; text, so that nothing is imported before it is used
BUILT_IN: dict[str, dict[str, str]] = {
    "input": {"csv": "rems_net.agents.csv_input:CsvInput"},
    "output": {"csv": "rems_net.agents.csv_output:CsvOutput"},
    "process": {},
    "definition": {"woodbot": "rems_net.robots.woodbot:Woodbot"},
    "driver": {
        "kinematic": "rems_net.drivers.kinematic:Kinematic",
        "mujoco": "rems_net.drivers.mujoco:Mujoco",
        "pybullet": "rems_net.drivers.pybullet:Pybullet",
    },
}

#: what is being loaded, innermost last
_loading: list[Path | str] = []


class ScriptEnd(BaseException):
    """Raised where a user's script, loaded in a host, would run its experiment.

    What the script defines before that line is all a host needs, so a script needs no
    `if __name__ == "__main__":`.
    """


def loading() -> bool:
    """Whether this process is loading a script for its classes only."""
    return bool(_loading)


def load(reference: str, folder: Path) -> type:
    """Import `module:Class` or `file.py:Class`. Raises ExperimentError."""
    where, _, qualname = reference.rpartition(":")
    if where.endswith(".py"):
        module = load_file((folder / where).resolve())
    else:
        module = _import(where)
    found: object = module
    for part in qualname.split("."):
        found = getattr(found, part, None)
    if not isinstance(found, type):
        classes = [k for k, v in vars(module).items() if isinstance(v, type)]
        raise ExperimentError(
            f"{where} has no class {qualname!r}.{nearest(qualname, classes)}"
        )
    return found


def _import(name: str) -> ModuleType:
    _loading.append(name)
    try:
        return importlib.import_module(name)
    except ScriptEnd:
        raise ExperimentError(
            f"{name} runs an experiment when it is imported; put the line with run() "
            'under `if __name__ == "__main__":`.'
        ) from None
    except RemsError:
        raise
    except ImportError as error:
        raise ExperimentError(f"Cannot import {name!r}: {error}.") from None
    except (Exception, SystemExit) as error:
        raise _failure(error) from error
    finally:
        _loading.pop()


def _failure(error: BaseException) -> ExperimentError:
    """What went wrong in a user's code, in one sentence."""
    if isinstance(error, SyntaxError):
        return ExperimentError(f"{error.filename}, line {error.lineno}: {error.msg}.")
    return ExperimentError(describe(error))


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
        if isinstance(error, RemsError | KeyboardInterrupt):
            raise
        raise _failure(error) from error
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
