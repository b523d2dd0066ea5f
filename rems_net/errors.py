"""Every error that rems_net raises on purpose, in one tree.

RemsError
|-- SchemaError            (ValueError)       a schema or definition that cannot be
|   `-- FixedKeysError     (TypeError)        a DefDict's keys cannot be removed
|-- UnknownFieldError      (KeyError)         no field of that name
|   `-- UnknownAttributeError (AttributeError)  the same, asked for with a dot
|-- FieldValueError        (ValueError)       wrong type, shape or range, NaN
|   `-- UnitError                             wrong dimension, or an unknown unit
|-- ConversionError        (TypeError)        schema A cannot become schema B
|   `-- DimensionError     (UnitError)        ... because of a dimension
|-- UnreachableError       (ValueError)       a pose or a speed that it cannot have
|-- WireError              (ValueError)       bytes that do not fit
|-- FabricError            (ConnectionError)  no router, refused, lost
|   |-- NoRouterError                         none listens there, now
|   `-- DeniedError                           the user may not do that there
|-- ExperimentError        (ValueError)       an experiment that cannot be started
|-- AgentError             (RuntimeError)     an agent failed; .agent and .cause
|-- ConformanceError       (AssertionError)   a robot does not do what robots must
`-- MissingPartError       (ImportError)      an optional library is missing

A message names the expected value, the received one, and the next thing to type. It
ends in a code for the kind of mistake: `rems explain R0104` prints more about that one.
"""

import re
from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


class RemsError(Exception):
    """The root: `except RemsError` catches every deliberate error of rems_net."""

    def __str__(self) -> str:
        # KeyError would print the repr of its message; a sentence stays a sentence.
        return str(self.args[0]) if self.args else ""


class SchemaError(RemsError, ValueError):
    """A schema or a definition is invalid."""


class FixedKeysError(SchemaError, TypeError):
    """The keys of a DefDict are those of its schema and cannot be removed."""


class UnknownFieldError(RemsError, KeyError):
    """No field has this name or path."""


class UnknownAttributeError(UnknownFieldError, AttributeError):
    """No field has this name; it was asked for as `value.name`."""


class FieldValueError(RemsError, ValueError):
    """A value has the wrong type, shape or range for its field."""


class UnitError(FieldValueError):
    """A unit is unknown, or belongs to another quantity than the field."""


class ConversionError(RemsError, TypeError):
    """One schema cannot be converted into another."""


class DimensionError(ConversionError, UnitError):
    """One schema cannot be converted into another: a dimension differs."""


class UnreachableError(RemsError, ValueError):
    """An arm cannot reach a pose, or a base cannot drive a velocity.

    nearest: what comes nearest to it (of an arm: its joints and their pose)
    away: distance from the wanted one, m (of a base: m/s)
    off: angle from the wanted one, rad (of a base: rad/s)
    """

    def __init__(
        self, message: str, nearest: Any = None, away: float = 0.0, off: float = 0.0
    ) -> None:
        super().__init__(message)
        self.nearest, self.away, self.off = nearest, away, off


class WireError(RemsError, ValueError):
    """Bytes from the wire do not fit the schema they claim."""


class FabricError(RemsError, ConnectionError):
    """The fabric cannot be reached, refused us, or was lost."""


class NoRouterError(FabricError):
    """No router is at an address now; one may have been, and may come back."""


class DeniedError(FabricError):
    """The router knows this user, but the user may not do that on this fabric."""


class ExperimentError(RemsError, ValueError):
    """An experiment cannot be started."""


class AgentError(RemsError, RuntimeError):
    """An agent failed; `agent` is its key, `cause` the reason."""

    def __init__(self, agent: str, cause: str) -> None:
        super().__init__(f"{agent}: {cause}")
        self.agent = agent
        self.cause = cause

    def __reduce__(self) -> "tuple[type[AgentError], tuple[str, str]]":
        return type(self), (self.agent, self.cause)


class ConformanceError(RemsError, AssertionError):
    """A robot breaks a rule for all robots; the message is the whole report."""


class MissingPartError(RemsError, ImportError):
    """An optional library is missing or broken."""


def nearest(name: object, candidates: Iterable[str], cutoff: float = 0.6) -> str:
    """Return " Did you mean 'x'?" for the closest candidate, or ""."""
    from difflib import get_close_matches  # takes 2 ms to load

    text = str(name)
    known = list(candidates)
    lowered = {one.lower(): one for one in known}
    found = get_close_matches(text.lower(), list(lowered), n=1, cutoff=cutoff)
    if not found:
        tail = text.rpartition("/")[2].lower()
        found = [low for low in lowered if low.rpartition("/")[2] == tail][:1]
    return f" Did you mean {lowered[found[0]]!r}?" if found else ""


def uncoded(error: object) -> str:
    """Return the message of an error without its code, for a longer sentence."""
    return re.sub(r" \(R\d{4}\)$", "", str(error))


def because(error: object) -> str:
    """Return the message of an error, without its code, to end a longer sentence."""
    text = uncoded(error)
    return text if text.endswith(("?", ".")) else f"{text}."


def longer(error: object, more: str) -> str:
    """Return a message with `more` behind it; its code stays at the end."""
    text, bare = str(error), uncoded(error)
    return f"{bare}{more}{text[len(bare) :]}"


def some(names: Iterable[str], most: int = 12) -> str:
    """Return names for a sentence; of many only the first, and how many more."""
    known = list(names)
    more = f" and {len(known) - most} more" if len(known) > most else ""
    return (", ".join(known[:most]) or "none") + more


def shown(path: "Path") -> str:
    """Return a path relative to the working folder, if it is below that."""
    with suppress(ValueError, OSError):  # OSError: the working folder was removed
        return str(path.relative_to(path.cwd()))
    return str(path)


def whereabouts(path: "Path", *suffixes: str) -> str:
    """Return where a missing file was looked for, and the nearest name there.

    Notepad adds `.txt` to a name, and Windows hides the endings of names.
    """
    try:
        folder = path.absolute().parent
    except OSError:  # the working folder was removed
        return f"{path}."
    if not folder.is_dir():
        return f"{path.name}, nor its folder {folder}."
    known = {*suffixes, ".txt"}
    here = sorted(one.name for one in folder.glob("*") if one.suffix.lower() in known)
    begin = [one for one in here if one.lower().startswith(f"{path.name.lower()}.")]
    hint = nearest(path.name, begin, 0.0) or nearest(path.name, here)
    return f"{path.name} in {folder}.{hint}"
