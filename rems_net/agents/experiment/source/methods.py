"""Mistakes in the methods of a user's class, with their line, before the start."""

import inspect
import json
from collections.abc import Collection, Mapping

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import check_call, takes, written
from rems_net.agents.ports import Settings
from rems_net.agents.protocol.plan import COMMON, Plan
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
    "out: declare its settings by `options = Settings(...)`, and make what it needs "
    "in `def open(self)`."
)


def _check_constructor(cls: type[Agent], plan: Plan) -> None:
    """Refuse an __init__ that an agent cannot be built by."""
    words = ["options", "folder", "out", "every"]
    words += ["parameters", "initial"] if plan.kind == "robot" else []
    if not takes(cls.__init__, 2, *words):
        own = inspect.signature(cls.__init__)
        raise SchemaError(
            f"{written(cls, '__init__')} is `def __init__{own}`; {_INSTEAD} (R0504)"
        )


def check_words(cls: type[Agent], words: Mapping[str, object]) -> None:
    """Refuse words beside an agent's name that nothing takes. Raises ExperimentError.

    words: those that are no In of this class, and none of the words of every agent.
    """
    check_nested(words, {"options": cls})
    own, ins = cls.options.schema.entries, cls.ins()
    options = f"options ({', '.join(own)})" if own else "options"
    for word in words:
        raise ExperimentError(
            f"there is no setting {word!r}; beside its name it may have "
            f"{', '.join([*ins, options, *COMMON])}."
            f"{nearest(word, [*ins, *own, *COMMON])} (R0407)"
        )


def check_nested(
    words: Mapping[str, object],
    declared: Mapping[str, type[Agent]],
    known: Collection[str] = (),
) -> None:
    """Refuse settings of a class beside the agent's name: they have a table.

    declared: by table, such as `options`, the class that declares it. known: the words
    that do stand beside the name. Raises ExperimentError with the table to write.
    """
    for slot, cls in declared.items():
        settings = getattr(cls, slot, None)
        if not isinstance(settings, Settings):
            continue
        own = settings.schema.entries.keys() - {*known}
        flat = {w: words[w] for w in words if w.partition("/")[0] in own}
        if flat:
            raise ExperimentError(
                f"{', '.join(flat)} {'belongs' if len(flat) == 1 else 'belong'} in the "
                f"{slot} of {cls.__name__}; write {slot}={{{_settings(flat)}}}. (R0407)"
            )


def _settings(given: Mapping[str, object]) -> str:
    """Return settings as they are written in a table."""
    return ", ".join(f'"{word}": {_value(value)}' for word, value in given.items())


def _value(value: object) -> str:
    if isinstance(value, str | bool | int | float):
        is_text = isinstance(value, str)
        said = json.dumps(value, ensure_ascii=False) if is_text else repr(value)
        if len(said) <= 60:
            return said
    return "..."
