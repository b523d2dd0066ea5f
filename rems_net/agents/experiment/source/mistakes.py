"""Mistakes in a user's class, found before it runs."""

import sys
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path

from rems_net.agents.agent import Agent, Input, Output, Process
from rems_net.agents.experiment.source.code import (
    dropped,
    functions,
    instructions,
)
from rems_net.agents.ports import In, Out, Port, Settings
from rems_net.agents.protocol.plan import COMMON, Plan
from rems_net.agents.robot import Robot, combine
from rems_net.agents.verbs import Verbs
from rems_net.defdict import Schema
from rems_net.errors import SchemaError, nearest
from rems_net.uncaught import is_users

#: base class of agents, by kind
PLAIN: tuple[type[Agent], ...] = (Input, Process, Output, Robot)
#: Words where an agent is added, besides the sources of its Ins.
ADDED = ("type", *COMMON)
#: Similarity above which an attribute is taken for a misspelt port.
ALIKE = 0.8


def check_class(plan: Plan, words: Collection[str] = ()) -> None:
    """Find missing and mixed-up parts of an agent's class. Raises SchemaError.

    words: those beside its name that are no In of it.
    """
    cls = combine(*plan.classes) if len(plan.classes) == 2 else plan.classes[0]
    users = [b for b in cls.__mro__ if is_users(_file(b))]
    theirs = [b for b in cls.__mro__ if b.__module__.partition(".")[0] != "rems_net"]
    _check_settings(cls, theirs)
    if users:
        _check_names(cls)
        _check_directions(plan, cls, words)
        _check_calls(cls, users)
        _check_attributes(plan.kind, cls, users)


def _file(cls: type) -> str | None:
    return getattr(sys.modules.get(cls.__module__), "__file__", None)


def _check_settings(cls: type[Agent], users: list[type]) -> None:
    """Find settings that no Settings declares, and misspelt names of such."""
    for base in users:
        own = vars(base)
        for name in own.keys() & {"options", "parameters"}:
            if not isinstance(own[name], Settings):
                raise SchemaError(
                    f"{base.__name__}.{name} is {own[name]!r:.60}; declare settings by "
                    f"{name} = Settings(speed=number(default=3)). (R0470)"
                )
    for base in users:
        given = vars(base).get("adjustable", ())
        if given == ():
            continue
        slots = [getattr(cls, slot, None) for slot in ("parameters", "options")]
        known = [n for one in slots if one for n, _ in one.schema.rows()]
        names = given if isinstance(given, list | tuple | set) else [given]
        wrong = [one for one in names if one not in known]
        if wrong or names is not given:
            hint = nearest(wrong[0], known) if wrong else ""
            raise SchemaError(
                f"{base.__name__}.adjustable is {given!r:.60}; expected names of its "
                f'settings, such as ("{next(iter(known), "speed")}",).{hint} (R0470)'
            )


def _check_names(cls: type[Agent]) -> None:
    """Find a port with a name that every agent uses for something else."""
    plain = next(b for b in PLAIN if issubclass(cls, b))
    taken = {*dir(plain), *vars(plain("any")), *ADDED} - plain.ports().keys()
    for name, port in cls.ports().items():
        if name in taken:
            raise SchemaError(
                f"{port.owner}.{name} is an {type(port).__name__}, and every "
                f"{plain.kind} has something else by the name {name!r}; give the port "
                "another one, such as 'value'. (R0505)"
            )


def _check_directions(plan: Plan, cls: type[Agent], words: Collection[str]) -> None:
    """Find an In where an Out belongs, and the other way round."""
    ports = cls.ports()
    if plan.kind == "robot":
        for name, kind in {"command": In, "state": Out, "sensors": Out}.items():
            _expect(name, getattr(cls, name), kind)
    elif plan.kind == "input" and cls.ins() and not cls.outs():
        _expect(*next(iter(ports.items())), Out)
    for name in words:
        if name in cls.outs():  # it is set where the agent is added, like a connection
            _expect(name, ports[name], In)


def _expect(name: str, port: object, kind: type[Port]) -> None:
    if not isinstance(port, Port):
        raise SchemaError(
            f"{name} is a {type(port).__name__}, and no port; write {name} = "
            f"{kind.__name__}(Schema(...)). (R0509)"
        )
    if not isinstance(port, kind):
        does = {In: "an In is read by its agent", Out: "an Out is set by its agent"}
        own = In if isinstance(port, In) else Out
        raise SchemaError(
            f"{port.owner}.{name} is an {own.__name__}, and {does[own]}; write "
            f"{name} = {kind.__name__}(...). (R0506)"
        )


def _check_attributes(kind: str, cls: type[Agent], users: list[type]) -> None:
    """Find attributes that are set under a wrong name, or although they are Ins."""
    ports, mine = cls.ports(), users[0].__name__
    codes = [f.__code__ for base in users for f in functions(base)]
    done = [one for code in codes for one in instructions(code)]
    used = {name for what, name, _ in done if what in ("LOAD_ATTR", "LOAD_METHOD")}
    for name in dict.fromkeys(n for what, n, me in done if me and what == "STORE_ATTR"):
        if isinstance(ports.get(name), In) and kind != "robot":
            raise SchemaError(
                f"{mine} sets self.{name}, which is an In: what it reads. Values for "
                f"other agents have an Out: {name} = Out(...). (R0506)"
            )
        _check_taken(kind, cls, mine, name)
        if kind != "robot" and isinstance(there := getattr(cls, name, None), Schema):
            _expect(name, there, Out)
        if name in used or hasattr(cls, name):
            continue
        if hint := nearest(name, ports, ALIKE):
            raise SchemaError(
                f"{mine} sets self.{name}, which nothing reads, and it has no such "
                f"port.{hint} (R0506)"
            )


def _check_calls(cls: type[Agent], users: list[type]) -> None:
    """Find a verb that is named and not called."""
    verbs = {name for name, port in cls.ports().items() if isinstance(port, Verbs)}
    for function in (f for base in users if verbs for f in functions(base)):
        for (verb, *names), line in dropped(function.__code__):
            if found := verbs.intersection(names):
                file = Path(function.__code__.co_filename).name
                raise SchemaError(
                    f"{users[0].__name__} names the verb {verb!r} of {found.pop()} and "
                    f"does not call it ({file}, line {line}); write {verb}(). (R0515)"
                )


def _check_taken(kind: str, cls: type[Agent], mine: str, name: str) -> None:
    """Find a user's attribute that every agent of the kind has already."""
    plain = next(b for b in PLAIN if issubclass(cls, b))
    theirs = getattr(plain, name, None)
    own = name in vars(plain("any")) and name not in plain.ports()
    method = callable(theirs) and not isinstance(theirs, type)
    if own or method or isinstance(theirs, property | cached_property):
        raise SchemaError(
            f"{mine} sets self.{name}, which every {kind} has for something else; "
            f"call it self.my_{name}. (R0505)"
        )


def idle(agents: Mapping[str, Agent], plans: Mapping[str, Plan]) -> str:
    """Return a sentence about robots that nothing commands at full speed; or "".

    A robot with a safe command other than standstill is left out: that may be on
    purpose. So is one that obeys nothing.
    """
    rest = [
        agent
        for key, agent in agents.items()
        if not plans[key].reads("command") and getattr(agent, "obeys", True)
    ]
    idle = [a.key for a in rest if isinstance(a, Robot) and not any(_numbers(a))]
    if not idle:
        return ""
    more = f" (and {len(idle) - 1} more)" if len(idle) > 1 else ""
    return (
        f'nothing commands {idle[0]}{more}, and at pace "fast" no program outside is '
        'in time to: write such as command = "input/NAME", or run it at pace 1.'
    )


def _numbers(robot: Agent) -> Iterator[bool]:
    """Yield, for each number of the safe command, whether it is not 0."""
    safe = robot.schemas()["command"]()
    for path in safe.schema.paths:
        yield isinstance(safe[path], int | float) and safe[path] != 0
