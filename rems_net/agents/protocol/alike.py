"""Alike: the things that a run's laptops must have in common: rems_net, definitions."""

import getpass
import re
from collections.abc import Callable
from contextlib import suppress

import rems_net
from rems_net.agents.protocol.limits import NAME
from rems_net.agents.protocol.shapes import pair, text, wrong
from rems_net.defdict import Field, Schema
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.events import info
from rems_net.router.mail import Question
from rems_net.router.message import machine, pack, read
from rems_net.router.session import Session

#: Prefix of the numerics that a robot's own firmware reports.
FIRMWARE = "Woodbot "
#: Number of laptops that are reported.
MOST = 30
_VERSION = re.compile(r"[0-9][0-9A-Za-z.+!]*")


def pack_version() -> bytes:
    """Return `[machine, version]` of this machine, packed."""
    return pack([laptop(), rems_net.__version__])


def read_version(payload: bytes) -> tuple[str, str]:
    """Read a machine and its version. Raises WireError."""
    name, there = pair(read(payload), "it", "[machine, version]")
    version = text(there, "its version", 40)
    if not _VERSION.fullmatch(version):
        raise wrong("its version", version, "a version, such as '0.1.0'")
    return text(name, "its machine", NAME), version


def laptop() -> str:
    """Return the name of this machine, as it is sent."""
    return "".join(c if c.isprintable() else "?" for c in machine())[:NAME]


def user() -> str:
    """Return the name of this machine's user, as it is sent; it proves nothing."""
    # its exceptions differ between systems, and are not documented
    with suppress(Exception):
        return "".join(c if c.isprintable() else "?" for c in getpass.getuser())[:NAME]
    return "nobody"


def check_version(session: Session) -> None:
    """Raise FabricError if the clock of this fabric has another rems_net.

    If no clock answers, no error is raised; and any program can answer in its place.
    """
    found = {}
    for mail in session.ask(session.key("clock", "@version"), pack_version()):
        with suppress(WireError):
            name, there = read_version(mail.payload)
            found[there] = name
    ours = rems_net.__version__
    for there, name in found.items() if ours not in found else ():
        raise FabricError(
            f"this laptop has rems_net {ours}, and the clock's, {name}, has {there}. "
            f'Type: pip install "rems-net=={there}" (R0617)'
        )


def tell_version(session: Session) -> Callable[[Question], None]:
    """Return the clock's answering function; it reports each other version once."""
    told: set[str] = set()

    def answer(question: Question) -> None:
        question.answer(session.key("clock", "@version"), pack_version())
        try:
            name, there = read_version(question.payload)
        except WireError:  # a caller need not send its version
            return
        if there != rems_net.__version__ and name not in told and len(told) < MOST:
            told.add(name)
            info(
                "version",
                f"{name} has rems_net {there}, and this laptop "
                f"{rems_net.__version__}: it is not let in until both have one version",
            )

    return answer


def unlike(
    key: str, port: str, here: Schema, there: bytes, name: str, *, board: bool = False
) -> ExperimentError:
    """Return the error that names the field that differs, how, and what to do.

    here: the schema on the clock's machine; there: that on `name`, packed.
    board: whether that is a robot's own firmware.
    """
    try:
        what = _first(here, Schema.from_wire(there))
    except WireError:
        what = ""
    what = f": {what}" if what else f"; its {port} is another"
    where = "in its firmware" if board else f"on {name}"
    do = "Give both the same files."
    if board:
        do = "Type here: rems board generate. Then flash it."
    return ExperimentError(
        f"{key} is defined differently {where} and on the clock's machine{what}. {do}"
        " (R0445)"
    )


def _first(here: Schema, there: Schema) -> str:
    """Return a sentence part about the first field that differs; "" if none does."""
    mine, theirs = dict(here.rows()), dict(there.rows())
    for path in [*mine, *(p for p in theirs if p not in mine)]:
        if path not in theirs:
            return f"it has no {path!r} there"
        if path not in mine:
            return f"{path!r} is there only"
        other, one = _show(theirs[path]), _show(mine[path])
        if other != one:
            return f"{path!r} is {other} there, and {one} here"
    return ""


def _show(field: Field) -> str:
    bounds = f" from {field.range[0]:g} to {field.range[1]:g}" if field.range else ""
    return f"{field.describe_type()} [{field.unit}]{bounds}"
