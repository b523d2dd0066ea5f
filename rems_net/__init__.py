"""rems_net: one robot definition, run as model, simulation and hardware at once.

from rems_net import Experiment

lab = Experiment("lab", dt="0.1 s", duration="10 s")
lab.input("keys", "csv", options={"file": "keys.csv"})
lab.robot("model", "woodbot", "kinematic", command="input/keys")
lab.output("log", "csv")
lab.run()
"""

import sys

# A constant of its own: `import typing` could load a user's typing.py.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from types import TracebackType

    from rems_net.agents.agent import Input, Output, Process
    from rems_net.agents.experiment.experiment import Experiment
    from rems_net.agents.experiment.file import load
    from rems_net.agents.ports import In, Out, Settings
    from rems_net.agents.robot import Definition, Driver
    from rems_net.agents.tick import Tick
    from rems_net.agents.verbs import Verbs, verb
    from rems_net.client import join
    from rems_net.defdict import DefDict, Field, Rule, Schema, merge_schemas, rule
    from rems_net.errors import (
        AgentError,
        ConformanceError,
        ConversionError,
        DimensionError,
        ExperimentError,
        FabricError,
        FieldValueError,
        MissingPartError,
        RemsError,
        SchemaError,
        UnitError,
        UnknownFieldError,
        UnreachableError,
        WireError,
    )
    from rems_net.identification.recorded import identify
    from rems_net.maths import atan2, cos, exp, hypot, log, sin, sincos, tan
    from rems_net.recordings.parting.together import together
    from rems_net.recordings.recording import read
    from rems_net.robots.create2 import Create2
    from rems_net.robots.differential import Differential
    from rems_net.robots.dynabot import Dynabot
    from rems_net.robots.epuck import Epuck, EpuckWithCamera
    from rems_net.robots.moose import Moose
    from rems_net.robots.pioneer import Pioneer3AT, Pioneer3DX
    from rems_net.robots.scaler import Scaler, ScalerLeft
    from rems_net.robots.woodbot import Woodbot
    from rems_net.robots.youbot import Youbot, YoubotArm, YoubotBase
    from rems_net.sweeps.sweep import sweep
    from rems_net.testing import check_robot

#: module -> its public names; imported at first use, so that a host or the command line
#: loads only what it needs
_HOMES = {
    "rems_net.agents.agent": "Input Output Process",
    "rems_net.agents.experiment.experiment": "Experiment",
    "rems_net.agents.experiment.file": "load",
    "rems_net.agents.ports": "In Out Settings",
    "rems_net.agents.robot": "Definition Driver",
    "rems_net.agents.tick": "Tick",
    "rems_net.agents.verbs": "Verbs verb",
    "rems_net.client": "join",
    "rems_net.defdict": "DefDict Field Rule Schema merge_schemas rule",
    "rems_net.errors": (
        "AgentError ConformanceError ConversionError DimensionError ExperimentError "
        "FabricError FieldValueError MissingPartError RemsError SchemaError "
        "UnitError UnknownFieldError UnreachableError WireError"
    ),
    "rems_net.identification.recorded": "identify",
    "rems_net.maths": "atan2 cos exp hypot log sin sincos tan",
    "rems_net.recordings.parting.together": "together",
    "rems_net.recordings.recording": "read",
    "rems_net.robots.create2": "Create2",
    "rems_net.robots.differential": "Differential",
    "rems_net.robots.dynabot": "Dynabot",
    "rems_net.robots.epuck": "Epuck EpuckWithCamera",
    "rems_net.robots.moose": "Moose",
    "rems_net.robots.pioneer": "Pioneer3AT Pioneer3DX",
    "rems_net.robots.scaler": "Scaler ScalerLeft",
    "rems_net.robots.woodbot": "Woodbot",
    "rems_net.robots.youbot": "Youbot YoubotArm YoubotBase",
    "rems_net.sweeps.sweep": "sweep",
    "rems_net.testing": "check_robot",
}

__all__ = [
    "AgentError",
    "ConformanceError",
    "ConversionError",
    "Create2",
    "DefDict",
    "Definition",
    "Differential",
    "DimensionError",
    "Driver",
    "Dynabot",
    "Epuck",
    "EpuckWithCamera",
    "Experiment",
    "ExperimentError",
    "FabricError",
    "Field",
    "FieldValueError",
    "In",
    "Input",
    "MissingPartError",
    "Moose",
    "Out",
    "Output",
    "Pioneer3AT",
    "Pioneer3DX",
    "Process",
    "RemsError",
    "Rule",
    "Scaler",
    "ScalerLeft",
    "Schema",
    "SchemaError",
    "Settings",
    "Tick",
    "UnitError",
    "UnknownFieldError",
    "UnreachableError",
    "Verbs",
    "WireError",
    "Woodbot",
    "Youbot",
    "YoubotArm",
    "YoubotBase",
    "atan2",
    "check_robot",
    "cos",
    "exp",
    "hypot",
    "identify",
    "join",
    "load",
    "log",
    "merge_schemas",
    "read",
    "rule",
    "sin",
    "sincos",
    "sweep",
    "tan",
    "together",
    "verb",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    # Imported here: a user's file that hides a module of Python must not stop `import
    # rems_net`.
    from rems_net.doors import door

    return door(__name__, _HOMES)[0](name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


#: modules without which nothing can be printed; `rems_net.uncaught` reports the others
_FIRST = {"importlib", "linecache", "pathlib", "re", "traceback", "types", "typing"}


def _hides(error: BaseException, trace: "TracebackType | None") -> str:
    """Return the sentence if a user's file was imported as a module of Python, or "".

    It imports nothing, since that would run the user's file once more.
    """
    folder = sys.path[0] if sys.path else ""  # folder of the script
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
    kind: type[BaseException], error: BaseException, trace: "TracebackType | None"
) -> None:
    """Print an error that a script does not catch with its own lines, without ours."""
    try:
        said = _hides(error, trace)
        if not said:
            from rems_net.uncaught import sentences

            said = "\n".join(sentences(error, trace))
    except Exception:  # the error must not be lost, even if Python is in a bad state
        said = ""
    if said:
        print(said, file=sys.stderr, flush=True)
    else:
        _told_before(kind, error, trace)


_told_before, sys.excepthook = sys.excepthook, _tell
