"""Offered: the files, ports and addresses that another machine's plan may use here.

Settings are text from another person, and agents open files and devices by such text.
Agents of an offer run in a folder that holds only the offer's files, so a relative name
finds one of those, or nothing. Every other text is refused here, or listed for the user
to allow: a serial port, or an address of another machine.
"""

import re
from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

from rems_net.agents import registry
from rems_net.agents.protocol.limits import PATH
from rems_net.agents.protocol.placement import RESERVED, Offer
from rems_net.agents.protocol.plan import (
    COMMON,
    ROBOT,
    Table,
    class_names,
    class_words,
    each,
)
from rems_net.errors import ExperimentError

#: Characters of a port or an address that a user can be expected to read.
LONGEST = 200
#: Beginnings of texts that a system or a shell takes for a folder elsewhere.
_ELSEWHERE = ("/", "\\", "~", "$", "%")
_DRIVE = re.compile(r"\s*[a-z]:|.*://", re.IGNORECASE | re.DOTALL)
#: A stream of a file of Windows, or an address.
_STREAM = re.compile(r":[^\s\d]")
_UP = re.compile(r"\s*\.\.[. ]*")
_ADDRESS = re.compile(
    r"""
    /dev/(tty|cu\.|pts/|serial/|rfcomm)[\w.:+/-]*   # a serial port of Linux or macOS
    | (\\\\\.\\)? (com|lpt) \d{1,3} :?              # of Windows
    | (?!file:) [a-z][a-z0-9+.-]* :// \S+           # a URL
    | \d{1,3} (\.\d{1,3}){3} (:\d+)?                # IPv4
    | \[? [0-9a-f]* : [0-9a-f.]* : [0-9a-f:.]* \]? (:\d+)?   # IPv6
    | [\w-][\w.-]+ : \d{1,5}                        # a host and a port
    | [\w-]+ (\.[\w-]+)* \. (local|lan|home|internal)
    """,
    re.VERBOSE | re.IGNORECASE | re.ASCII,
)


class Use(NamedTuple):
    """A port or an address that an agent of an offer uses, not allowed yet."""

    agent: str
    text: str


def uses(offer: Offer) -> list[Use]:
    """Return the ports and addresses that an offer names.

    Raises ExperimentError for a setting that could open anything else. The error does
    not depend on the files of this machine, so it reveals nothing about them.
    """
    found: dict[Use, None] = {}
    for of, plan in each(offer.agents):
        agent = f"{of}/{plan['name']}"
        for cls, kind, settings in _settings(of, plan):
            ours = cls in registry.BUILT_IN[kind].values()
            for text in _texts(settings):
                if not text or text in offer.files:
                    continue
                if (kind == "driver" or not ours) and _is_address(text):
                    found[Use(agent, text)] = None
                elif leads_out(text):
                    raise _refused(agent, text)
                elif kind == "driver" and not ours:  # It may be the name of a host.
                    if not _can_be_shown(text):
                        raise _refused(agent, text)
                    found[Use(agent, text)] = None
    for word in offer.words:
        if _is_address(word):
            found[Use("the script", word)] = None
        elif leads_out(word):
            raise _refused("the script", word)
    return list(found)


def check_allowed(used: Collection[Use], allowed: Collection[str]) -> None:
    """Raise ExperimentError for a port or an address that is not among `allowed`."""
    missing = sorted({use.text for use in used} - {*allowed})
    if missing:
        raise ExperimentError(
            f"the run would use {', '.join(missing)} of this laptop, or from it; with "
            f"--yes such is named, too: --allow {' '.join(missing)} (R0443)"
        )


def leads_out(text: str) -> bool:
    """Return whether a name may be one outside the folder that it is searched in.

    On any system: so also drives, network folders and devices of Windows.
    """
    parts = re.split(r"[/\\]", text)
    return bool(
        len(text) > PATH
        or "\0" in text
        or text.lstrip().startswith(_ELSEWHERE)
        or "\\" in text
        or _STREAM.search(text)
        or _DRIVE.match(text)
        or any(map(_UP.fullmatch, parts))
        or any(map(RESERVED.fullmatch, parts))
    )


def _is_address(text: str) -> bool:
    return _can_be_shown(text) and ".." not in text and bool(_ADDRESS.fullmatch(text))


def _can_be_shown(text: str) -> bool:
    """Return whether the whole text can be shown to the user as it is."""
    return len(text) <= LONGEST and text.isprintable()


def _settings(of: str, plan: Table) -> Iterator[tuple[str, str, Any]]:
    """Yield each class of a plan, its kind, and its settings."""
    first, *rest = class_names(of, plan)
    if of != "robot":
        known = {"name", *class_words(of), *COMMON}
        yield first, of, {w: v for w, v in plan.items() if w not in known}
        return
    yield rest[0], ROBOT[1], plan.get("options")
    for slot in ("parameters", "initial", "marker"):
        yield first, ROBOT[0], plan.get(slot)


def _texts(settings: Any) -> Iterator[str]:
    """Yield every text in settings, at any depth."""
    left = [settings]
    while left:
        value = left.pop()
        if isinstance(value, str):
            yield value
        elif isinstance(value, dict):
            left += value.values()
        elif isinstance(value, list):
            left += value


def _refused(agent: str, text: str) -> ExperimentError:
    return ExperimentError(
        f"{agent} is given {text!r:.80}, which is none of the files that come with "
        "the run: nothing else of this laptop is opened for it. (R0443)"
    )
