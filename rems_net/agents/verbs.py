"""Verbs: methods of an agent that other processes may call, by value.

    class Gripper(Driver):
        @verb
        def open(self, width: float) -> str: ...

From outside: `fabric.robot("arm").open(0.02)`, or ask `rems/robot/arm/@call/open`
with the msgpack map `{"args": [0.02], "kwargs": {}}`.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from rems_net.errors import AgentError, RemsError, WireError, nearest
from rems_net.router.message import pack, read

Method = TypeVar("Method", bound=Callable[..., Any])

_MARK = "__rems_verb__"
#: bytes that a verb may be called with
LONGEST = 1_000_000


def verb(method: Method) -> Method:
    """Mark a method as callable over the fabric; it runs between two ticks."""
    setattr(method, _MARK, True)
    return method


def verbs_of(agent: object) -> dict[str, Callable[..., Any]]:
    """The methods of `agent` that are verbs, by name."""
    return {name: getattr(agent, name) for name in verb_names(type(agent))}


def verb_names(cls: type) -> list[str]:
    """The names of the methods of a class that are verbs."""
    marked = {
        name
        for base in cls.__mro__
        for name, method in vars(base).items()
        if hasattr(method, _MARK)
    }
    return sorted(marked)


def request(args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> bytes:
    """The payload of a call. Raises WireError for what cannot travel by value."""
    return _packed({"args": list(args), "kwargs": dict(kwargs)}, "an argument")


def perform(
    verbs: Mapping[str, Callable[..., Any]], name: str, payload: bytes
) -> bytes:
    """Call the verb and return the payload of its answer, exceptions included."""
    try:
        if name not in verbs:
            have = ", ".join(sorted(verbs)) or "none"
            raise WireError(
                f"there is no verb {name!r}; there is {have}.{nearest(name, verbs)}"
            )
        args, kwargs = _words(payload)
        result = verbs[name](*args, **kwargs)
        return _packed({"result": result}, f"the result of {name}")
    except RemsError as error:
        return pack({"error": str(error)})
    except Exception as error:
        # Carried to the caller, whose mistake it usually is; the agent goes on.
        return pack({"error": f"{type(error).__name__}: {error}"})


def _words(payload: bytes) -> tuple[list[Any], dict[str, Any]]:
    """What a verb is called with. Raises WireError."""
    if len(payload) > LONGEST:
        raise WireError(f"{len(payload)} bytes came; a call takes at most {LONGEST}.")
    words = read(payload) if payload else {}
    if type(words) is dict and words.keys() <= {"args", "kwargs"}:
        args, kwargs = words.get("args", []), words.get("kwargs", {})
        if type(args) is list and type(kwargs) is dict:
            return args, kwargs
    raise WireError(
        f"it is called with {words!r:.80}; expected a map such as "
        '{"args": [0.02], "kwargs": {}}.'
    )


def outcome(agent: str, payload: bytes) -> Any:
    """The result in an answer. Raises AgentError with what the verb raised."""
    answer = read(payload)
    if "error" in answer:
        raise AgentError(agent, answer["error"])
    return answer["result"]


def _packed(value: Any, what: str) -> bytes:
    try:
        return pack(plain(value))
    except TypeError as error:
        raise WireError(
            f"{what} cannot travel over the fabric ({error}); expected numbers, text, "
            "lists and dicts of them, or a DefDict."
        ) from None


def plain(value: Any) -> Any:
    """Return a value as numbers, text, lists and dicts, as far as it has these."""
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):  # numpy's scalars and arrays
        return value.tolist()
    return value
