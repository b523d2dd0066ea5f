"""Keys of values: `<fabric>/<kind>/<name>/<port>[/<field>...]`.

Chunks that begin with `@` are for the machinery; neither `*` nor `**` of Zenoh matches
them.
"""

import re
from functools import lru_cache

from rems_net.errors import ExperimentError, nearest

KINDS = ("input", "robot", "world", "process", "output", "clock")
FABRIC = "rems"

#: letters. Longest name that can be one chunk of a key.
LONGEST = 63
_NAME = re.compile(rf"[A-Za-z0-9](?:[A-Za-z0-9_.-]{{0,{LONGEST - 2}}}[A-Za-z0-9_-])?")
#: what Windows takes for a device, with any ending: `con.csv` is no file there
_DEVICE = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d)(?:\.|\Z)", re.I | re.A)


#: Chunk of the keys of agents in lock-step. Values there must not be lost, so their
#: writer waits for a slow reader. `*` and `**` do not match the chunk: a program that
#: only looks subscribes to the plain key, and values that it is too slow for are
#: dropped.
STEP = "@step"
#: In place of a name: the values of many agents of one process, in one message. For
#: members it is STEP: a rule of access with one such chunk matches no key with two.
ALL = "@crowd"


@lru_cache(maxsize=65536)
def plain_key(key: str) -> str:
    """Return the key of a port, of a crowd's, or of the clock's, without STEP."""
    fabric, kind, *rest = key.split("/")
    if rest[:1] == [STEP] and kind != "clock":
        return "/".join((fabric, kind, ALL, *rest[1:]))
    return key.replace(f"/{STEP}/", "/", 1)


@lru_cache(maxsize=65536)
def crowd_key(key: str) -> tuple[str, str]:
    """Return the key at which a port comes with those of others, and its agent."""
    fabric, kind, name, port = key.split("/", 3)
    return f"{fabric}/{kind}/{ALL}/{port}", name


def check_name(name: object, what: str) -> str:
    """Return `name` if it can be one chunk of a key, else raise ExperimentError."""
    if isinstance(name, str) and is_name(name):
        return name
    if isinstance(name, str) and _DEVICE.match(name):
        raise ExperimentError(
            f"{what} is {name!r}, which Windows takes for a device: no file can have "
            f"this name there. Give another one, such as my_{name}. (R0610)"
        )
    raise ExperimentError(
        f"{what} is {name!r}; a name has 1 to 63 letters, digits, '_', '-' or '.', "
        "begins with a letter or a digit, and ends with no '.'. (R0610)"
    )


def is_name(name: object) -> bool:
    """Return whether `name` can be one chunk of a key."""
    if not isinstance(name, str) or _NAME.fullmatch(name) is None:
        return False
    return _DEVICE.match(name) is None


def agent_of(key: str) -> str:
    """Return `robot/sim` for `rems/robot/sim/state`."""
    return "/".join(key.split("/")[1:3])


def full_key(key: str, fabric: str = FABRIC) -> str:
    """Return a key with its fabric: `rems/robot/sim/state` for `robot/sim/state`.

    A glob may stand for the kind. Raises ExperimentError for an invalid key.
    """
    trimmed = key.strip("/'\"")  # the quotes, too: cmd of Windows leaves them
    first, _, rest = trimmed.partition("/")
    if not trimmed or any(not c or set(c) & set("#?$[]") for c in trimmed.split("/")):
        raise ExperimentError(
            f"{key!r} is not a key; expected <kind>/<name>/<port>, "
            f"such as robot/sim/state, or a glob such as 'robot/*/state' or "
            "'robot/ca*/state', where * is any letters. (R0610)"
        )
    if first == fabric or first == "**":
        return trimmed
    known = first in KINDS or "*" in first
    if known or not rest:
        if not known:
            hint = nearest(first, KINDS)
            raise ExperimentError(
                f"{key!r} is not a key: it begins with none of "
                f"{', '.join(KINDS)}.{hint} (R0610)"
            )
        return f"{fabric}/{trimmed}"
    raise ExperimentError(
        f"{key!r} begins with {first!r}; a key begins with the fabric's name "
        f"({fabric!r}) or with one of {', '.join(KINDS)}.{nearest(first, KINDS)}"
        " (R0610)"
    )
