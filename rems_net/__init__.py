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

    # The public names. `doors` imports each at its first use, so that a host or the
    # command line loads only what it needs.
    from rems_net.agents.agent import (
        Input as Input,
        Output as Output,
        Process as Process,
    )
    from rems_net.agents.experiment.experiment import Experiment as Experiment
    from rems_net.agents.experiment.file import load as load
    from rems_net.agents.ports import In as In, Out as Out, Settings as Settings
    from rems_net.agents.robot import Definition as Definition, Driver as Driver
    from rems_net.agents.tick import Tick as Tick
    from rems_net.agents.verbs import Verbs as Verbs, verb as verb
    from rems_net.client import join as join
    from rems_net.defdict import (
        DefDict as DefDict,
        Field as Field,
        Rule as Rule,
        Schema as Schema,
        merge_schemas as merge_schemas,
        rule as rule,
    )
    from rems_net.errors import (
        AgentError as AgentError,
        ConformanceError as ConformanceError,
        ConversionError as ConversionError,
        DimensionError as DimensionError,
        ExperimentError as ExperimentError,
        FabricError as FabricError,
        FieldValueError as FieldValueError,
        MissingPartError as MissingPartError,
        RemsError as RemsError,
        SchemaError as SchemaError,
        UnitError as UnitError,
        UnknownFieldError as UnknownFieldError,
        UnreachableError as UnreachableError,
        WireError as WireError,
    )
    from rems_net.identification.recorded import identify as identify
    from rems_net.maths import (
        atan2 as atan2,
        cos as cos,
        exp as exp,
        hypot as hypot,
        log as log,
        sin as sin,
        sincos as sincos,
        tan as tan,
    )
    from rems_net.recordings.parting.together import together as together
    from rems_net.recordings.recording import read as read
    from rems_net.robots.create2 import Create2 as Create2
    from rems_net.robots.differential import Differential as Differential
    from rems_net.robots.dynabot import Dynabot as Dynabot
    from rems_net.robots.epuck import Epuck as Epuck, EpuckWithCamera as EpuckWithCamera
    from rems_net.robots.moose import Moose as Moose
    from rems_net.robots.pioneer import (
        Pioneer3AT as Pioneer3AT,
        Pioneer3DX as Pioneer3DX,
    )
    from rems_net.robots.scaler import Scaler as Scaler, ScalerLeft as ScalerLeft
    from rems_net.robots.woodbot import Woodbot as Woodbot
    from rems_net.robots.youbot import (
        Youbot as Youbot,
        YoubotArm as YoubotArm,
        YoubotBase as YoubotBase,
    )
    from rems_net.sweeps.sweep import sweep as sweep
    from rems_net.testing import check_robot as check_robot

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    # Imported here: a user's file that hides a module of Python must not stop `import
    # rems_net`.
    from rems_net.doors import door

    return door(__name__)[0](name)


def __dir__() -> list[str]:
    from rems_net.doors import door

    return door(__name__)[1]()


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
