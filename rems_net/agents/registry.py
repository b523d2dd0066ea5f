"""References to classes: `module:Class` or `file.py:Class`, in every process."""

import builtins
import importlib
import importlib.util
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any

from rems_net.agents.diagnosis import describe
from rems_net.errors import ExperimentError, RemsError, nearest, uncoded, whereabouts
from rems_net.uncaught import LIBRARIES, NEEDED, hiding_here

#: kind -> name -> `module:Class`; text, so that nothing is imported before its use
BUILT_IN: dict[str, dict[str, str]] = {
    "input": {
        "csv": "rems_net.inputs.csv:CsvInput",
        "gamepad": "rems_net.inputs.gamepad:GamepadInput",
        "hand": "rems_net.inputs.hand:HandInput",
        "keyboard": "rems_net.inputs.hand:KeyboardInput",
        "replay": "rems_net.inputs.replay:ReplayInput",
    },
    "output": {
        "csv": "rems_net.outputs.csv:CsvOutput",
        "mcap": "rems_net.outputs.mcap:McapOutput",
        "pictures": "rems_net.outputs.pictures:PicturesOutput",
        "plot": "rems_net.outputs.plot:PlotOutput",
    },
    "process": {
        "ekf": "rems_net.processes.kalman:Ekf",
        "residual": "rems_net.processes.residual:Residual",
        "ukf": "rems_net.processes.kalman:Ukf",
        "localise": "rems_net.processes.localise:Localise",
    },
    "world": {"world": "rems_net.agents.world:World"},
    "definition": {
        "woodbot": "rems_net.robots.woodbot:Woodbot",
        "create2": "rems_net.robots.create2:Create2",
        "camera": "rems_net.robots.eyes.camera:Camera",
        "dynabot": "rems_net.robots.dynabot:Dynabot",
        "epuck": "rems_net.robots.epuck:Epuck",
        "epuck_camera": "rems_net.robots.epuck:EpuckWithCamera",
        "pioneer3dx": "rems_net.robots.pioneer:Pioneer3DX",
        "pioneer3at": "rems_net.robots.pioneer:Pioneer3AT",
        "moose": "rems_net.robots.moose:Moose",
        "youbot": "rems_net.robots.youbot:Youbot",
        "youbot_base": "rems_net.robots.youbot:YoubotBase",
        "youbot_arm": "rems_net.robots.youbot:YoubotArm",
        "scaler": "rems_net.robots.scaler:Scaler",
        "scaler_left": "rems_net.robots.scaler:ScalerLeft",
    },
    "driver": {
        "kinematic": "rems_net.drivers.kinematic.kinematic:Kinematic",
        "mujoco": "rems_net.drivers.physics.mujoco:Mujoco",
        "pybullet": "rems_net.drivers.physics.pybullet:Pybullet",
        "create2": "rems_net.drivers.hardware.create2.open_interface:OpenInterface",
        "woodbot-ws": "rems_net.drivers.hardware.woodbot_websocket:OriginalFirmware",
        "webots": "rems_net.drivers.webots.webots:Webots",
        "webcam": "rems_net.drivers.hardware.camera.webcam:Webcam",
        "dynabot": "rems_net.drivers.hardware.dynamixel.wheels:Wheels",
        "scaler": "rems_net.drivers.hardware.dynamixel.arms:Arms",
        "remote": "rems_net.drivers.remote:Remote",
    },
}

Runner = Callable[..., Any]

#: runners of experiments, one for each script that is being run, innermost last
_runners: list[Runner | None] = []
#: script -> the line with the `input()` at which loading it ended
_asked: dict[str, int] = {}
#: module of a script -> content of its file when it was loaded
_sources: dict[str, bytes] = {}
#: module of a script -> the experiment at whose `run()` loading it ended
_begun: dict[str, Any] = {}
#: Number of times that a script may catch the exception of its `input()`.
TRIES = 10
#: whether a run has started this process, which then starts no run itself
_of_run = False
#: file descriptor of error output that is never discarded
_errors = 2


class ScriptEnd(SystemExit):
    """Ends a script that is loaded only for its definitions.

    A host needs only the definitions before the script runs its experiment, so a script
    needs no `if __name__ == "__main__":`. Loading also ends at an `input()`: the user
    has answered it once already. args: the experiment, and the pace given to `run`.
    """


@contextmanager
def running_by(runner: Runner | None) -> Iterator[None]:
    """Let `runner` run the experiments of a script, in place of their `run`.

    It is called with the experiment and the arguments; None: `run` runs as usual.
    """
    _runners.append(runner)
    try:
        yield
    finally:
        _runners.pop()


def runner() -> Runner | None:
    """Return the runner of the script that is being run, or None."""
    return _runners[-1] if _runners else None


def end_script(experiment: object, *_: Any, pace: object = None, **__: Any) -> None:
    """Stop a script that is loaded only for its definitions: raise ScriptEnd."""
    raise ScriptEnd(experiment, pace)


def enter_run() -> None:
    """Note that a run has started this process, for its agents or their jobs."""
    global _of_run
    _of_run = True


def end_import() -> None:
    """Raise ScriptEnd if a process of a run imports this file."""
    if _of_run and runner() is end_script:
        raise ScriptEnd


def check_starts(what: str) -> None:
    """Raise ExperimentError in a process of a run, ImportError in a hiding file.

    End a file that is imported for its classes, or a thread there, silently: raise
    ScriptEnd, or SystemExit, since a thread is silent with exactly this one.
    """
    if said := hiding_here(NEEDED if _of_run else LIBRARIES):
        raise ImportError(said)
    if runner() is end_script:
        raise ScriptEnd
    if _of_run and threading.current_thread() is not threading.main_thread():
        raise SystemExit
    if _of_run:
        raise ExperimentError(
            f"{what} is called in a process of an agent, which starts no others: put "
            'the line under `if __name__ == "__main__":`, or step the experiment there '
            "by its engine(). (R0430)"
        )


@contextmanager
def _reading() -> Iterator[None]:
    """Import a user's file: up to its run(), and silently in a process of a run.

    The process that started this one has printed its text already. Done by file
    descriptors, so that loggers created here keep their streams.
    """
    global _errors
    with running_by(end_script):
        if not _of_run:
            yield
            return
        _flush()
        kept = os.dup(1), os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        _errors = kept[1]
        try:
            for stream in (1, 2):
                os.dup2(nowhere, stream)
            yield
        finally:
            _flush()
            _errors = 2
            for stream, before in enumerate(kept, 1):
                os.dup2(before, stream)
                os.close(before)
            os.close(nowhere)


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        # a script may replace the streams
        with suppress(AttributeError, OSError, ValueError):
            stream.flush()


@contextmanager
def asking_nobody(path: Path) -> Iterator[None]:
    """End a script that is loaded for its definitions if it calls `input()`."""
    calls = 0

    def ask(*_: object) -> str:
        nonlocal calls
        calls += 1
        if calls > TRIES:  # no exception would end it
            sentence = (
                f"{path.name} calls input() again and again, and catches each error "
                "that ends it: write `except ValueError:` in place of `except:`."
            )
            os.write(_errors, f"{sentence}\n".encode())
            os._exit(1)
        _asked[str(path)] = sys._getframe(1).f_lineno
        raise ScriptEnd

    before = builtins.input
    builtins.input = ask
    try:
        yield
    finally:
        builtins.input = before


def find(reference: str, folder: Path) -> tuple[object, ModuleType]:
    """Return what has this name, such as `file.py:Class`, or None; and its module."""
    where, _, qualname = reference.rpartition(":")
    if where.endswith(".py"):
        module = load_file((folder / where).resolve())
    else:
        module = _import(where)
    found: object = module
    for part in qualname.split("."):
        found = getattr(found, part, None)
    return found, module


def load(reference: str, folder: Path) -> type:
    """Import `module:Class` or `file.py:Class`. Raises ExperimentError."""
    where, _, qualname = reference.rpartition(":")
    found, module = find(reference, folder)
    if not isinstance(found, type):
        classes = [k for k, v in vars(module).items() if isinstance(v, type)]
        if line := _asked.get(str(getattr(module, "__file__", ""))):
            raise ExperimentError(
                f"{where} has no class {qualname!r} before line {line}, where it calls "
                "input(); an agent's process reads it up to there: put classes before."
                " (R0429)"
            )
        raise ExperimentError(
            f"{where} has no class {qualname!r}.{nearest(qualname, classes)} (R0429)"
        )
    return found


def _import(name: str) -> ModuleType:
    try:
        with _reading():
            return importlib.import_module(name)
    except ScriptEnd:
        raise ExperimentError(
            f"{name} runs an experiment when it is imported; put the line with run() "
            'under `if __name__ == "__main__":`. (R0430)'
        ) from None
    except RemsError:
        raise
    except ImportError as error:
        raise ExperimentError(
            f"Cannot import {name!r}: {uncoded(error)}. (R0429)"
        ) from None
    except (Exception, SystemExit) as error:
        raise failure(error) from error


def failure(error: BaseException) -> ExperimentError:
    """Return an error of a user's code, in one sentence."""
    if isinstance(error, SyntaxError):
        return ExperimentError(
            f"{error.filename}, line {error.lineno}: {error.msg}. (R0429)"
        )
    return ExperimentError(describe(error))


def load_file(path: Path, name: str = "") -> ModuleType:
    """Run a user's file for its classes: once, and again after each change.

    A notebook writes its file again and again, and each run's hosts read the newest.
    name: of the module; by default derived from the path.
    """
    # Without a dot: pickle would look for a package named by the part before it.
    name = name or f"rems_script:{path}".replace(".", "%2E")
    known = sys.modules.get(name)
    if not path.is_file():
        if known is not None:
            return known
        raise ExperimentError(f"There is no file {whereabouts(path, '.py')} (R0401)")
    source = path.read_bytes()
    if known is not None and _sources.get(name) == source:
        return known
    _sources[name] = source
    _begun.pop(name, None)
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    sys.path.insert(0, str(path.parent))
    try:
        with _reading(), asking_nobody(path):
            # Not with the `from __future__` of this file.
            code = compile(source, str(path), "exec", dont_inherit=True)
            exec(code, module.__dict__)
    except ScriptEnd as end:
        _begun[name] = end.args[0] if end.args else None
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, RemsError | KeyboardInterrupt):
            raise
        raise failure(error) from error
    return module


def experiments_of(path: Path, kind: type) -> list[Any]:
    """Return the experiment that a script runs first, or else all that it makes.

    kind: the class of experiments. Raises ExperimentError.
    """
    module = load_file(path.resolve())
    if (begun := _begun.get(module.__name__)) is not None:
        return [begun]
    made = {id(one): one for one in vars(module).values() if isinstance(one, kind)}
    return [*made.values()]


def loaded_files() -> list[Path]:
    """Return the users' files that this process has loaded, and that still exist."""
    modules = [m for n, m in sys.modules.items() if n.startswith("rems_script:")]
    paths = [Path(str(module.__file__)) for module in modules]
    return [path for path in paths if path.exists()]
