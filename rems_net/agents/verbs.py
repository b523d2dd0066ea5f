"""Verbs: methods of an agent that other processes may call, by value.

    class Gripper(Driver):
        @verb
        def grip(self, width: float) -> str: ...

From outside: `fabric.robot("arm").grip(0.02)`, or ask `rems/robot/arm/@call/grip` with
the msgpack map `{"args": [0.02], "kwargs": {}}`. From a process that reads the robot,
with `verbs = Verbs(car)` below: `self.verbs.grip(0.02)`, done at the next tick.
"""

import inspect
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from threading import current_thread
from typing import Any, NamedTuple, TypeVar

from rems_net.agents.diagnosis import where
from rems_net.agents.ports import In, Out
from rems_net.agents.runtime import runtime
from rems_net.defdict import Schema, text
from rems_net.errors import (
    AgentError,
    RemsError,
    SchemaError,
    WireError,
    nearest,
    uncoded,
)
from rems_net.router.message import pack, read

Method = TypeVar("Method", bound=Callable[..., Any])

_MARK = "__rems_verb__"
#: Bytes. Longest payload of a call.
LONGEST = 1_000_000
#: Ticks. A process repeats its calls this long: messages to real robots may be lost.
KEPT = 10
#: Bytes. All calls of a process in that time fit into this.
MOST = 65_536
#: The port of a robot that receives calls: `@calls/process/referee/verbs`.
CALLED = "@calls"
#: The calls of a process: a list in JSON, which people can read, too.
CALLS = Schema("calls", {"calls": text(max_len=MOST)})


def verb(method: Method) -> Method:
    """Mark a method as callable over the fabric; it runs between two ticks."""
    setattr(method, _MARK, True)
    return method


def is_verb(method: object) -> bool:
    """Return whether a method is marked as a verb."""
    return hasattr(method, _MARK)


def verbs_of(agent: object) -> dict[str, Callable[..., Any]]:
    """Return the methods of `agent` that are verbs, by name."""
    return {name: getattr(agent, name) for name in verb_names(type(agent))}


def verb_names(cls: type) -> list[str]:
    """Return the names of the methods of a class that are verbs."""
    marked = {
        name
        for base in cls.__mro__
        for name, method in vars(base).items()
        if is_verb(method)
    }
    if getattr(cls, "adjustable", ()):
        marked.add("adjust")
    return sorted(marked)


def request(args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> bytes:
    """Return the payload of a call. Raises WireError for a value that is not plain."""
    return _packed({"args": list(args), "kwargs": dict(kwargs)}, "an argument")


def perform(
    verbs: Mapping[str, Callable[..., Any]], name: str, payload: bytes
) -> bytes:
    """Call the verb and return the payload of its answer, exceptions included."""
    try:
        args, kwargs = _words(payload)
        result = call(verbs, name, args, kwargs)
        return _packed({"result": result}, f"the result of {name}")
    except RemsError as error:
        return pack({"error": str(error)})
    except Exception as error:
        # The caller gets the error, which is usually its mistake; the agent goes on.
        return pack({"error": f"{type(error).__name__}: {error}"})


def call(
    verbs: Mapping[str, Callable[..., Any]],
    name: str,
    args: Sequence[Any],
    kwargs: Mapping[str, Any],
) -> Any:
    """Call the verb of this name. Raises WireError for a call that does not fit."""
    if name not in verbs:
        have = ", ".join(sorted(verbs)) or "none"
        raise WireError(
            f"there is no verb {name!r}; there is {have}.{nearest(name, verbs)} (R0513)"
        )
    signature = inspect.signature(verbs[name])
    try:
        signature.bind(*args, **kwargs)
    except TypeError as error:
        raise WireError(
            f"{uncoded(error)}; expected {name}{signature}. (R0513)"
        ) from None
    return verbs[name](*args, **kwargs)


def _words(payload: bytes) -> tuple[list[Any], dict[str, Any]]:
    """Return the arguments of a call. Raises WireError."""
    if len(payload) > LONGEST:
        raise WireError(
            f"{len(payload)} bytes came; a call takes at most {LONGEST}. (R0514)"
        )
    words = read(payload) if payload else {}
    if type(words) is dict and words.keys() <= {"args", "kwargs"}:
        args, kwargs = words.get("args", []), words.get("kwargs", {})
        if type(args) is list and type(kwargs) is dict:
            return args, kwargs
    raise WireError(
        f"it is called with {words!r:.80}; expected a map such as "
        '{"args": [0.02], "kwargs": {}}. (R0514)'
    )


def outcome(agent: str, payload: bytes) -> Any:
    """Return the result in an answer. Raises AgentError with the verb's error."""
    answer = read(payload)
    if "error" in answer:
        raise AgentError(agent, answer["error"])
    return answer["result"]


def _packed(value: Any, what: str) -> bytes:
    try:
        return pack(plain(value))
    except TypeError as error:
        raise WireError(
            f"{what} cannot travel over the fabric ({uncoded(error)}); expected "
            "numbers, text, lists and dicts of them, or a DefDict. (R0514)"
        ) from None


def plain(value: Any) -> Any:
    """Return a value as numbers, text, lists and dicts, as far as it has these.

    Raises TypeError for a value of unyt.
    """
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    units = getattr(value, "units", None)
    if units is not None and str(units) != "dimensionless":
        raise TypeError(
            f"{value} has a unit, which would be lost: type its number, in the unit "
            f"that the verb takes, or a text, '{value}' (R0514)"
        )
    if hasattr(value, "tolist"):  # numpy's scalars and arrays
        return value.tolist()
    return value


# -- called by a process -------------------------------------------------------------


class Call(NamedTuple):
    """A call of a process: the tick, the robot, the verb, and the line of code."""

    n: int
    robot: str
    verb: str
    args: list[Any]
    kwargs: dict[str, Any]
    line: str


class Verbs(Out):
    """The verbs of the robot that an In reads, for a process to call in its step.

        car = In(Cart.state)
        verbs = Verbs(car)

        def step(self, tick):
            if self.car.x > 1:
                self.verbs.reset()

    The robot acts upon a call of tick n before it steps at n + 1. A call returns None:
    its effect shows in the robot's ports. If the In reads several robots by a glob,
    each has its verbs by its key: `self.verbs["robot/a"].reset()`.
    """

    marks = False  # a process that makes no call has not forgotten to set it

    def __init__(self, reads: In):
        if not isinstance(reads, In):
            raise SchemaError(
                f"Verbs({reads!r:.60}) is of no In; write the In that reads the robot: "
                "car = In(Cart.state), and below it verbs = Verbs(car). (R0515)"
            )
        super().__init__(CALLS)
        self.reads = reads

    def __get__(self, instance: object | None, owner: type) -> Any:
        return self if instance is None else Called(instance, self)

    def __set__(self, instance: object, values: Any) -> None:
        raise SchemaError(
            f"{type(instance).__name__}.{self.name} is set, and it has the verbs of a "
            f"robot, which are called: self.{self.name}.reset(). (R0515)"
        )


class Called:
    """The verbs of one robot or, before one is chosen by its key, of all."""

    def __init__(self, process: object, port: Verbs, robot: str = ""):
        self.__process, self.__port, self.__robot = process, port, robot

    def __getitem__(self, robot: str) -> "Called":
        return Called(self.__process, self.__port, robot)

    def __getattr__(self, verb: str) -> Callable[..., None]:
        if verb.startswith("__"):
            raise AttributeError(verb)
        return partial(_note, self.__process, self.__port, self.__robot, verb)

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_"):
            raise SchemaError(
                f"the verb {name!r} is set to {value!r:.60}; a verb is called: "
                f"{name}({value!r:.60}) (R0515)"
            )
        super().__setattr__(name, value)


def _note(
    process: Any, port: Verbs, robot: str, verb: str, /, *args: Any, **kwargs: Any
) -> None:
    """Add a call to those that the process has made. Raises RemsError."""
    key, run, own = _chosen(process, port, robot), runtime(process), process.__dict__
    n = run.tick.n
    if not n:
        raise SchemaError(
            f"{key}.{verb}() is called before the first tick; call it in step. (R0515)"
        )
    made = Call(n, key, verb, [*args], kwargs, where(current_thread()))
    kept = [old for old in read_calls(own[port.name]["calls"]) if old.n > n - KEPT]
    try:
        said = json.dumps(plain([*kept, made]))
    except TypeError as error:
        raise SchemaError(
            f"{key}.{verb}() is called with what cannot travel ({uncoded(error)}); "
            "expected numbers, text, lists and dicts of them, or a DefDict. (R0514)"
        ) from None
    if len(said) > MOST:
        raise SchemaError(
            f"the calls of {KEPT} ticks take {len(said)} bytes, with {key}.{verb}(); "
            f"expected at most {MOST}: call less often, or with less. (R0515)"
        )
    own[port.name].update({"calls": said})


def _chosen(process: Any, port: Verbs, robot: str) -> str:
    """Return the key of the robot whose verb is called. Raises SchemaError."""
    reads = port.reads.name
    source = runtime(process).sources.get(reads, "")
    read = process.__dict__[reads] if "*" in source else [source]
    robots = list(dict.fromkeys("/".join(key.split("/")[:2]) for key in read))
    have = ", ".join(robots) or "nothing"
    # the In of a glob has it by the key of its port
    robot = "/".join(robot.split("/")[:2])
    if not robot and len(robots) == 1:
        return robots[0]
    if not robot:
        raise SchemaError(
            f"{reads} reads {have}; choose the robot, such as "
            f"self.{port.name}[{robots[0] if robots else 'robot/a'!r}].reset(). (R0515)"
        )
    if robot not in robots:
        raise SchemaError(
            f"the verbs of {robot!r} cannot be called: {reads} does not read it, but "
            f"{have}.{nearest(robot, robots)} (R0515)"
        )
    return robot


def read_calls(said: str) -> Iterator[Call]:
    """Yield the calls that a process publishes. Raises WireError for anything else."""
    try:
        rows = [Call(*row) for row in json.loads(said or "[]")]
    except (ValueError, TypeError):
        raise WireError(
            f"it is {said!r:.80}; expected a list of calls. (R0621)"
        ) from None
    for row in rows:
        types = [type(word) for word in row]
        if types != [int, str, str, list, dict, str]:
            raise WireError(f"it has {row!r:.80}; expected a call. (R0621)")
        yield row
