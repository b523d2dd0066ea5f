"""Placement: the offer that a run sends to a machine that brings some of its agents.

Plans are plain data, and name classes: parts that are installed there, or files below
that machine's own folder, by the digests that they have on the run's machine. The files
that an agent reads travel, in pieces, by their digest; code never does.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple
from unicodedata import normalize

from rems_net.agents.agent import PHASES
from rems_net.agents.protocol import limits, shapes
from rems_net.agents.protocol.plan import (
    Table,
    Tables,
    class_names,
    class_words,
    each,
    grouped,
    host_of,
    slots_of,
)
from rems_net.agents.verbs import CALLED
from rems_net.router.message import LAST_TICK, pack, read

#: Endings of files that may travel: data, nothing that a system would run.
DATA = ("csv", "tsv", "txt", "toml", "json", "yaml", "yml", "npy", "png", "jpg", "jpeg")
#: Endings of descriptions of robots and worlds, and of the meshes beside them.
MODELS = ("xml", "urdf", "stl", "obj", "msh")

_DIGEST = re.compile(r"[0-9a-f]{64}")
#: Characters that some system does not allow in a name, or reads in another way.
_NEVER = re.compile(r'[<>:"|?*\\]')
#: Names that are a device in every folder of Windows, with any ending.
RESERVED = re.compile(
    r"\s*(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9\u00b9\u00b2\u00b3])"
    r" *([.:].*)?",
    re.IGNORECASE,
)
_CLASS = re.compile(r"[A-Za-z_]\w{0,99}(\.[A-Za-z_]\w{0,99}){0,4}", re.ASCII)


class File(NamedTuple):
    """Size of a file [bytes], and its SHA-256."""

    size: int
    digest: str


class Offer(NamedTuple):
    """The agents that a machine is to bring, by host, and what they need.

    name: the experiment's. user,
    laptop: the sender's, unproven.
    agents: by kind, as in a file.
    taken: schemas of Ins, by agent.
    dt: s.
    seed: of all random numbers.
    words: the arguments of the script that runs it.
    files: to be sent.
    code: files that must be there, SHA-256 by name.
    native: whether agents use all features of each processor.
    """

    name: str
    user: str
    laptop: str
    agents: Tables
    taken: Mapping[str, Mapping[str, bytes]]
    dt: float
    seed: int
    words: Sequence[str]
    files: Mapping[str, File]
    code: Mapping[str, str]
    native: bool

    def to_wire(self) -> bytes:
        return pack(self._asdict())

    def hosts(self) -> dict[str, list[tuple[str, Table]]]:
        """Return kind and table of all agents, by their host."""
        return grouped((host_of(*one), one) for one in each(self.agents))


def read_offer(payload: bytes) -> Offer:
    """Read an offer of a run. Raises WireError for anything else."""
    plain = shapes.fields(read(payload), "what a run asks for", *Offer._fields)
    agents = shapes.table(plain["agents"], "its agents", len(PHASES))
    for kind, tables in agents.items():
        for one in shapes.items(tables, f"its agents of kind {kind}", limits.AGENTS):
            _check_plan(kind, one)
    if len({host_of(*one) for one in each(agents)}) > limits.HOSTS:
        raise shapes.wrong("its agents", agents, f"at most {limits.HOSTS} processes")
    for key, ports in shapes.table(
        plain["taken"], "its schemas", limits.AGENTS
    ).items():
        shapes.agent_key(key, "an agent")
        for port, schema in shapes.table(ports, "its Ins", limits.PORTS).items():
            shapes.name(port, "an In")
            if type(schema) is not bytes or len(schema) > limits.SCHEMA:
                raise shapes.wrong(port, schema, f"at most {limits.SCHEMA} bytes")
    files = {
        file_name(file, DATA + MODELS): File(
            shapes.whole(size, f"the size of {file}", 0, limits.FILE_BYTES),
            file_digest(digest),
        )
        for file, about in shapes.table(
            plain["files"], "its files", limits.SENT
        ).items()
        for size, digest in (shapes.pair(about, "a file", "a size and a digest"),)
    }
    if sum(file.size for file in files.values()) > limits.FILE_BYTES:
        raise shapes.wrong(
            "its files", len(files), f"{limits.FILE_BYTES} bytes at most"
        )
    code = {
        file_name(file, ("py",)): file_digest(digest)
        for file, digest in shapes.table(plain["code"], "its code", limits.SENT).items()
    }
    for names in (files, code):
        _check_apart(names)
    classes = (c for one in each(agents) for c in class_names(*one))
    sources = {where for where, _ in map(reference, classes) if where.endswith(".py")}
    if unknown := sorted(sources - code.keys()):
        raise shapes.wrong("its code", sorted(code), f"the digest of {unknown[0]}, too")
    words = shapes.items(plain["words"], "its words", limits.SOURCES)
    return Offer(
        shapes.name(plain["name"], "the experiment's name"),
        shapes.text(plain["user"], "its user", limits.NAME),
        shapes.text(plain["laptop"], "its machine", limits.NAME),
        agents,
        plain["taken"],
        shapes.real(plain["dt"], "its dt", 1e-9),
        shapes.whole(plain["seed"], "its seed", 0, 2**63),
        [shapes.shown(word, "a word", limits.CAUSE) for word in words],
        files,
        code,
        shapes.flag(plain["native"], "whether it is native"),
    )


def _check_apart(names: Collection[str]) -> None:
    """Raise WireError for two names that some system takes for one, or for a folder."""
    same = {normalize("NFKC", one).casefold() for one in names}
    folders = {folder.as_posix() for one in same for folder in PurePath(one).parents}
    if len(same) < len(names) or same & folders:
        raise shapes.wrong("its files", sorted(names), "names that differ in letters")


def _check_plan(kind: str, plan: Any) -> None:
    given = dict(shapes.table(plan, "a plan", limits.SOURCES))
    shapes.agent_key(f"{kind}/{given.pop('name', '')}", "an agent")
    for word in class_words(kind):
        reference(given.pop(word, ""))
    shapes.whole(given.pop("every", 1), "every", 1, LAST_TICK)
    shapes.real(given.pop("since", 0.0), "since")
    shapes.whole(given.pop("restart", 0), "restart")
    shapes.host_name(given.pop("host", "x"), "its host")
    shapes.name(given.pop("machine", "x"), "its machine")
    for one in shapes.items(given.pop("rules", []), "its rules", limits.SOURCES):
        reference(one)
    if kind == "robot":
        shapes.name(given.pop("world", "x"), "its world")
        command = given.pop("command", "input/x")
        for word, said in ("command", command), (CALLED, given.pop(CALLED, [])):
            for one in (
                [said]
                if type(said) is str
                else shapes.items(said, word, limits.SOURCES)
            ):
                shapes.source(one, word, limits.SOURCE)
    for slot in slots_of(kind):
        shapes.table(given.pop(slot, {}), slot, limits.SOURCES)
    if kind == "robot" and given:
        raise shapes.wrong("a plan of a robot", [*given], "no other words")


def reference(value: Any) -> tuple[str, str]:
    """Return the file (`lab.py`) or module of a class, and its name there."""
    where, colon, cls = shapes.text(value, "a class", limits.SOURCE).rpartition(":")
    if where.endswith(".py"):
        file_name(where, ("py",))
    elif not colon or not _CLASS.fullmatch(where):
        raise shapes.wrong("a class", value, "module:Class or file.py:Class")
    if not _CLASS.fullmatch(cls):
        raise shapes.wrong("a class", value, "module:Class or file.py:Class")
    return where, cls


def file_name(value: Any, suffixes: Sequence[str]) -> str:
    """Return the name of a file below a folder, with slashes on every system."""
    parts = shapes.text(value, "a file", limits.NAME).split("/")
    good = len(parts) <= limits.DEPTH and not any(
        part.startswith((".", " ", "~"))
        or part.endswith((".", " "))
        or not part
        or RESERVED.fullmatch(part)
        for part in parts
    )
    if not good or _NEVER.search(value):
        raise shapes.wrong(
            "a file", value, "a name below the folder, such as 'data/keys.csv'"
        )
    if value.rpartition(".")[2].lower() not in suffixes:
        raise shapes.wrong("a file", value, f"one that ends with {', '.join(suffixes)}")
    return str(value)


def file_digest(value: Any) -> str:
    """Return a SHA-256: 64 hexadecimal digits."""
    if type(value) is not str or not _DIGEST.fullmatch(value):
        raise shapes.wrong("a digest", value, "64 hexadecimal digits")
    return value


class Caller(NamedTuple):
    """Laptop that asks a run for its offer, and why it refuses; "" if it does not."""

    laptop: str
    trouble: str

    def to_wire(self) -> bytes:
        return pack(list(self))


def read_caller(payload: bytes) -> Caller:
    """Read a caller. Raises WireError for anything else."""
    laptop, trouble = shapes.pair(read(payload), "it", "[laptop, trouble]")
    return Caller(
        shapes.text(laptop, "its machine", limits.NAME),
        shapes.shown(trouble, "its trouble", limits.CAUSE),
    )
