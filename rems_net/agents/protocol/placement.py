"""Placement: what a run gives a machine that brings some of its agents.

Plans are plain data, and name classes: parts that are installed there, or files below
that machine's own folder, by the digests that they have on the run's machine. What an
agent reads travels, in pieces, by its digest; code never does.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple
from unicodedata import normalize

from rems_net.agents.protocol import limits
from rems_net.agents.protocol.shapes import (
    agent_key,
    fields,
    flag,
    host_name,
    items,
    name,
    shown,
    source,
    table,
    text,
    whole,
    wrong,
)
from rems_net.errors import WireError
from rems_net.router.message import LAST_TICK, pack, read

#: what a file that travels may be: data, nothing that a system would run
DATA = ("csv", "tsv", "txt", "toml", "json", "yaml", "yml", "npy", "png", "jpg", "jpeg")
#: what robots and worlds are described in, and the meshes beside it
MODELS = ("xml", "urdf", "stl", "obj", "msh")

_DIGEST = re.compile(r"[0-9a-f]{64}")
#: no system takes these in a name, or takes them for something else
_NEVER = re.compile(r'[<>:"|?*\\]')
#: a name that is a device in every folder of Windows, whatever it ends with
RESERVED = re.compile(
    r"\s*(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9\u00b9\u00b2\u00b3])"
    r" *([.:].*)?",
    re.IGNORECASE,
)
_CLASS = re.compile(r"[A-Za-z_]\w{0,99}(\.[A-Za-z_]\w{0,99}){0,4}", re.ASCII)

#: words of a plan; those of a robot have two more
PLAN = (
    *("kind", "name", "classes", "options", "sources", "taken"),
    *("every", "since", "seed"),
)
ROBOT = ("parameters", "initial")


class File(NamedTuple):
    """How long a file is [bytes], and its SHA-256."""

    size: int
    digest: str


class Offer(NamedTuple):
    """What a machine shall bring: the agents of each host, and what they need.

    name: the experiment's.  user, laptop: who runs it, and where, as they say.
    hosts: plans of each host.  words: the arguments of the script that runs it.
    files: what is sent.  code: what must be there, SHA-256 by name.
    native: whether agents compute with all that each processor has.
    """

    name: str
    user: str
    laptop: str
    hosts: Mapping[str, Sequence[Mapping[str, Any]]]
    words: Sequence[str]
    files: Mapping[str, File]
    code: Mapping[str, str]
    native: bool

    def to_wire(self) -> bytes:
        return pack(self._asdict())

    def plans(self) -> Iterator[Mapping[str, Any]]:
        """Return all plans, of all hosts."""
        return (plan for plans in self.hosts.values() for plan in plans)


def read_offer(payload: bytes) -> Offer:
    """Read what a run offers. Raises WireError for anything else."""
    plain = fields(read(payload), "what a run asks for", *Offer._fields)
    hosts = table(plain["hosts"], "its hosts", limits.HOSTS)
    for host, plans in hosts.items():
        host_name(host, "a host")
        for plan in items(plans, f"the agents of {host}", limits.AGENTS):
            _check_plan(plan)
    files = {
        file_name(file, DATA + MODELS): File(
            whole(_pair(about)[0], f"the size of {file}", 0, limits.FILE_BYTES),
            file_digest(about[1]),
        )
        for file, about in table(plain["files"], "its files", limits.SENT).items()
    }
    if sum(file.size for file in files.values()) > limits.FILE_BYTES:
        raise wrong("its files", len(files), f"{limits.FILE_BYTES} bytes at most")
    code = {
        file_name(file, ("py",)): file_digest(digest)
        for file, digest in table(plain["code"], "its code", limits.SENT).items()
    }
    for names in (files, code):
        _check_apart(names)
    classes = (c for plans in hosts.values() for plan in plans for c in plan["classes"])
    sources = {where for where, _ in map(reference, classes) if where.endswith(".py")}
    if unknown := sorted(sources - code.keys()):
        raise wrong("its code", sorted(code), f"the digest of {unknown[0]}, too")
    words = items(plain["words"], "its words", limits.SOURCES)
    return Offer(
        name(plain["name"], "the experiment's name"),
        text(plain["user"], "its user", limits.NAME),
        text(plain["laptop"], "its machine", limits.NAME),
        hosts,
        [shown(word, "a word", limits.CAUSE) for word in words],
        files,
        code,
        flag(plain["native"], "whether it is native"),
    )


def _check_apart(names: Collection[str]) -> None:
    """Raise WireError for two names that are one, or a file and a folder, somewhere."""
    same = {normalize("NFKC", one).casefold() for one in names}
    folders = {folder.as_posix() for one in same for folder in PurePath(one).parents}
    if len(same) < len(names) or same & folders:
        raise wrong("its files", sorted(names), "names that differ in letters")


def _pair(value: Any) -> list[Any]:
    if len(items(value, "a file", 2)) < 2:
        raise wrong("a file", value, "a size and a digest")
    return list(value)


def _check_plan(plan: Any) -> None:
    robot = type(plan) is dict and plan.get("kind") == "robot"
    fields(plan, "a plan", *PLAN, *(ROBOT if robot else ()))
    agent_key(f"{plan['kind']}/{plan['name']}", "an agent")
    classes = items(plan["classes"], "its classes", 2)
    if len(classes) != (2 if robot else 1):
        raise wrong("its classes", classes, "a definition and a driver, or one class")
    for one in classes:
        reference(one)
    for word in ("options", *(ROBOT if robot else ())):
        _bytes(plan[word], word)
    for port, connected in table(plan["sources"], "its Ins", limits.PORTS).items():
        name(port, "an In")
        source(connected, port, limits.SOURCE)
    for port, schema in table(plan["taken"], "its Ins", limits.PORTS).items():
        name(port, "an In")
        _bytes(schema, port)
    whole(plan["every"], "every", 1, LAST_TICK)
    whole(plan["since"], "since", 1, LAST_TICK)
    whole(plan["seed"], "its seed", 0, 2**63)


def _bytes(value: Any, what: str) -> None:
    if type(value) is not bytes or len(value) > limits.SCHEMA:
        raise wrong(what, value, f"at most {limits.SCHEMA} bytes")


def reference(value: Any) -> tuple[str, str]:
    """A class: the file (`lab.py`) or module that it is in, and its name there."""
    where, colon, cls = text(value, "a class", limits.SOURCE).rpartition(":")
    if where.endswith(".py"):
        file_name(where, ("py",))
    elif not colon or not _CLASS.fullmatch(where):
        raise wrong("a class", value, "module:Class or file.py:Class")
    if not _CLASS.fullmatch(cls):
        raise wrong("a class", value, "module:Class or file.py:Class")
    return where, cls


def file_name(value: Any, suffixes: Sequence[str]) -> str:
    """The name of a file below a folder, with slashes, whatever the system."""
    parts = text(value, "a file", limits.NAME).split("/")
    good = len(parts) <= limits.DEPTH and not any(
        part.startswith((".", " ", "~"))
        or part.endswith((".", " "))
        or not part
        or RESERVED.fullmatch(part)
        for part in parts
    )
    if not good or _NEVER.search(value):
        raise wrong("a file", value, "a name below the folder, such as 'data/keys.csv'")
    if value.rpartition(".")[2].lower() not in suffixes:
        raise wrong("a file", value, f"one that ends with {', '.join(suffixes)}")
    return str(value)


def file_digest(value: Any) -> str:
    """A SHA-256: 64 hexadecimal digits."""
    if type(value) is not str or not _DIGEST.fullmatch(value):
        raise wrong("a digest", value, "64 hexadecimal digits")
    return value


class Caller(NamedTuple):
    """Who asks a run what to bring, and why it cannot; "" where it can."""

    laptop: str
    trouble: str

    def to_wire(self) -> bytes:
        return pack(list(self))


def read_caller(payload: bytes) -> Caller:
    """Read who asks. Raises WireError for anything else."""
    words = items(read(payload), "who asks", 2)
    if len(words) != 2:
        raise WireError(f"it is {words!r:.80}; expected [laptop, trouble].")
    return Caller(
        text(words[0], "its machine", limits.NAME),
        shown(words[1], "its trouble", limits.CAUSE),
    )
