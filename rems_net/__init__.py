"""rems_net: one robot definition, run as model, simulation and hardware at once.

from rems_net import Experiment

lab = Experiment("lab", dt="0.1 s", duration="10 s")
lab.input("keys", "csv", file="keys.csv")
lab.robot("model", "woodbot", "kinematic", command="input/keys")
lab.output("log", "csv")
lab.run()
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # typing's own; a user's typing.py would be taken for it
if TYPE_CHECKING:
    from types import TracebackType

    from rems_net.agents.agent import Input, Output, Process
    from rems_net.agents.experiment.experiment import Experiment
    from rems_net.agents.experiment.file import load
    from rems_net.agents.ports import In, Out, Settings
    from rems_net.agents.robot import Definition, Driver
    from rems_net.agents.tick import Tick
    from rems_net.agents.verbs import verb
    from rems_net.client import join
    from rems_net.defdict import DefDict, Field, Schema
    from rems_net.errors import RemsError
    from rems_net.recordings.recording import read

#: public name -> where it is; imported when it is first used, so that a host or the
#: command line loads only what it needs
_HOMES = {
    "DefDict": "rems_net.defdict",
    "Definition": "rems_net.agents.robot",
    "Driver": "rems_net.agents.robot",
    "Experiment": "rems_net.agents.experiment.experiment",
    "Field": "rems_net.defdict",
    "In": "rems_net.agents.ports",
    "Input": "rems_net.agents.agent",
    "Out": "rems_net.agents.ports",
    "Output": "rems_net.agents.agent",
    "Process": "rems_net.agents.agent",
    "RemsError": "rems_net.errors",
    "Schema": "rems_net.defdict",
    "Settings": "rems_net.agents.ports",
    "Tick": "rems_net.agents.tick",
    "join": "rems_net.client",
    "load": "rems_net.agents.experiment.file",
    "read": "rems_net.recordings.recording",
    "verb": "rems_net.agents.verbs",
}

__all__ = [
    "DefDict",
    "Definition",
    "Driver",
    "Experiment",
    "Field",
    "In",
    "Input",
    "Out",
    "Output",
    "Process",
    "RemsError",
    "Schema",
    "Settings",
    "Tick",
    "join",
    "load",
    "read",
    "verb",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    from importlib import import_module

    try:
        home = _HOMES[name]
    except KeyError:
        # The two names let Python say which was meant.
        raise AttributeError(
            f"module 'rems_net' has no attribute {name!r}",
            name=name,
            obj=sys.modules[__name__],
        ) from None
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


#: what is needed to say anything at all; others that are hidden are told with lines
_FIRST = {"importlib", "linecache", "pathlib", "re", "traceback", "types", "typing"}


def _hides(error: BaseException, trace: TracebackType | None) -> str:
    """What to say where a user's file was taken for a module of Python.

    It imports nothing, which would run that file once more.
    """
    folder = sys.path[0] if sys.path else ""  # where the script is
    while trace and isinstance(error, ImportError | AttributeError):
        path = trace.tb_frame.f_code.co_filename
        name = path[len(folder) + 1 :].removesuffix(".py")
        if name in _FIRST and path.startswith(folder):
            return (
                f"{name}.py hides the module {name!r}, which rems_net needs. Rename "
                f"it, for example to my_{name}.py."
            )
        trace = trace.tb_next
    return ""


def _tell(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Tell what a script does not catch by its own lines, without ours."""
    try:
        said = _hides(error, trace)
        if not said:
            from rems_net.uncaught import sentences

            said = "\n".join(sentences(error, trace))
    except Exception:  # in whatever state Python is: the error must not be lost
        said = ""
    if said:
        print(said, file=sys.stderr, flush=True)
    else:
        _told_before(kind, error, trace)


_told_before, sys.excepthook = sys.excepthook, _tell
