"""Errors for wrong arguments: they name the arguments that a public function takes."""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import wraps
from inspect import Parameter, signature
from typing import Any, ParamSpec, TypeVar

from rems_net.errors import RemsError, nearest

P = ParamSpec("P")
R = TypeVar("R")


def taught(
    kind: type[RemsError], otherwise: str = "", **meant: str
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function raise `kind` if it is called with wrong arguments.

    meant: for names that are often tried, what to write instead.  otherwise: what to
    write for any other name, which replaces {word} in it.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                return function(*args, **kwargs)
            except TypeError as error:
                if not misfits(error):
                    raise
                sentence = misfit(function, args, kwargs, meant, otherwise)
                raise kind(sentence) from None

        return call

    return decorate


def misfits(error: TypeError) -> bool:
    """Return whether the call itself failed, and not the code that it called."""
    return error.__traceback__ is not None and error.__traceback__.tb_next is None


def misfit(
    function: Callable[..., object],
    args: Sequence[object],
    kwargs: Mapping[str, object],
    meant: Mapping[str, str],
    otherwise: str = "",
) -> str:
    """Return a sentence: the fault in the arguments of a call, and a correction."""
    own = signature(function).parameters
    bound = "self" in own
    takes = {name: one for name, one in own.items() if name != "self"}
    places = [n for n, one in takes.items() if one.kind is one.POSITIONAL_OR_KEYWORD]
    name, given = function.__name__, args
    if bound:
        name = type(args[0]).__name__ if name == "__init__" else name
        given = args[1:]
    for word in kwargs:
        if word not in takes:
            hint = nearest(word, takes) or otherwise.format(word=word)
            hint = f" Write {meant[word]}." if word in meant else hint
            return (
                f"{name}() does not take {word!r}. It takes {_listed(takes)}."
                f"{hint} (R0125)"
            )
    if len(given) > len(places):
        named = [word for word in takes if word not in places]
        return (
            f"{name}() takes {_listed(places) or 'nothing'} by place, and got "
            f"{len(given)} values; write the others by name: {_listed(named)}. (R0125)"
        )
    needed = [n for n in places[len(given) :] if takes[n].default is Parameter.empty]
    lacks = [n for n in needed if n not in kwargs]
    return (
        f"{name}() is called without {_listed(lacks)}. It takes {_listed(takes)}. "
        "(R0125)"
        if lacks
        else f"{name}() got a value twice: {_listed(kwargs)}. (R0125)"
    )


def _listed(names: Collection[Any]) -> str:
    return ", ".join(names)
