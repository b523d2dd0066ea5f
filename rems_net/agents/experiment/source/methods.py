"""Mistakes in the methods of a user's class, with their line, before the start."""

import inspect
from collections.abc import Callable, Mapping
from functools import lru_cache

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import check_call, written
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import RUNTIME
from rems_net.errors import ExperimentError, SchemaError, nearest

#: method of an agent -> names of its arguments
CALLED: dict[str, tuple[str, ...]] = {
    "prepare": (),
    "open": (),
    "read": ("tick",),
    "step": ("tick",),
    "write": ("tick",),
    "drive": ("command", "dt"),
    "sense": (),
    "close": (),
    "made": (),
}
#: Settings of every agent, besides those of its class.
COMMON = ("every", "since", "host", "rules")


def built(plan: Plan) -> Agent:
    """Build the agent and prepare it. Raises RemsError, naming the line to correct."""
    cls = plan.classes[0]
    _check_constructor(cls, plan)
    agent = plan.build()
    if RUNTIME not in vars(agent):
        raise SchemaError(
            f"{written(cls, '__init__')} does not call super().__init__; {_INSTEAD}"
            " (R0504)"
        )
    for name, words in CALLED.items():
        if callable(getattr(agent, name, None)):
            check_call(agent, name, *words)
    agent.prepare()
    given = agent.parameters if isinstance(agent, Robot) else agent.options
    for name, port in agent.ports().items():
        if name not in vars(agent) and port.schema_for(given) is not None:
            raise SchemaError(
                f"{written(agent, 'prepare')} does not call super().prepare(), which "
                f"makes {name} and all its ports; write that as its first line. (R0504)"
            )
    return agent


_INSTEAD = (
    "it is built from its name and settings, in a process of its own. Leave __init__ "
    "out: say what it can be told by `options = Settings(...)`, and make what it needs "
    "in `def open(self)`."
)


def _check_constructor(cls: type[Agent], plan: Plan) -> None:
    """Refuse an __init__ that an agent cannot be built by."""
    if not _takes_plan(cls.__init__, plan.kind == "robot"):
        own = inspect.signature(cls.__init__)
        raise SchemaError(
            f"{written(cls, '__init__')} is `def __init__{own}`; {_INSTEAD} (R0504)"
        )


@lru_cache(maxsize=1024)
def _takes_plan(init: Callable[..., None], robot: bool) -> bool:
    words = ["options", "folder", "out", "every"]
    words += ["parameters", "initial"] if robot else []
    try:
        inspect.signature(init).bind(None, "name", **dict.fromkeys(words))
    except TypeError:
        return False
    return True


def check_settings(cls: type[Agent], settings: Mapping[str, object]) -> None:
    """Refuse settings that an agent of this class lacks. Raises ExperimentError."""
    options = list(cls.options.schema.entries)
    for name in settings:
        if name in options or name.partition("/")[0] in options:
            continue
        if name == "options":
            raise ExperimentError(
                "there is no options= here; write each setting as its own, such as "
                f"{next(iter(options), 'gain')}=...; {_known(cls, options)}. (R0407)"
            )
        hint = nearest(name, [*options, *cls.ins(), *COMMON])
        raise ExperimentError(
            f"there is no setting {name!r}; {_known(cls, options)}.{hint} (R0407)"
        )


def _known(cls: type[Agent], options: list[str]) -> str:
    ins = f"its Ins ({', '.join(cls.ins())})" if cls.ins() else ""
    own = f"its options ({', '.join(options)})" if options else ""
    return f"{cls.__name__} takes {', '.join(filter(None, [own, ins, *COMMON]))}"
