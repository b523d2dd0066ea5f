"""`rems watch KEY`: values as they change, one line per message."""

import argparse
import json
from fnmatch import fnmatchcase
from typing import Any

from rems_net.cli.words import add_at, short_key, show_value, warn
from rems_net.client import Fabric, join
from rems_net.defdict import Schema
from rems_net.errors import FabricError, RemsError
from rems_net.router.asking import printable
from rems_net.router.keys import full_key
from rems_net.router.mail import Mail, Mailbox

EXAMPLES = """\
examples:
  rems watch robot/kinematic/state
  rems watch 'robot/*/state/heading'
  rems watch 'robot/*/state' --json
"""
#: s. After this silence, check that the fabric still exists.
SILENCE = 2.0
#: schemas of one port, at most, that are looked up
MOST = 8


def add(parser: argparse.ArgumentParser) -> None:
    """Add the options of `rems watch`."""
    parser.add_argument("key", metavar="KEY", help="a key or a glob (quote it)")
    parser.add_argument("--json", action="store_true", help="JSON, one line each")
    parser.add_argument("--count", metavar="N", type=int, help="end after N lines")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Print values as they come, until Ctrl+C or until the fabric ends."""
    full_key(args.key)  # Report a typo before looking for a fabric.
    box = Mailbox()
    left = args.count
    with join(fabric=args.fabric, at=args.at) as fabric:
        key = full_key(args.key, fabric.session.fabric)
        port, field = split(key)
        here = _processes(fabric)
        if not fabric.get(key):
            raise fabric.nothing_at(key)
        watcher = Watcher(fabric, field)
        fabric.session.watch(port, box)
        while left is None or left > 0:
            mail = box.get(SILENCE)
            # Another run may have taken the port of this one; and any program can put a
            # tick of its own.
            doubt = not isinstance(mail, Mail) or watcher.is_of_another_run(mail)
            if doubt and not here & _processes(fabric, or_none=True):
                warn("the fabric has ended.")
                return 0
            line = watcher.line(mail, args.json) if isinstance(mail, Mail) else None
            if line is not None:
                print(line, flush=True)
                left = None if left is None else left - 1
    return 0


def split(key: str) -> tuple[str, str]:
    """Return the key of the port, and the glob of its fields; only ports are put."""
    chunks = key.split("/")
    if "**" in chunks or len(chunks) <= 4:
        return key, "*"
    return "/".join(chunks[:4]), "/".join(chunks[4:])


class Watcher:
    """Conversion of messages into lines; each schema is looked up once."""

    def __init__(self, fabric: Fabric, field: str):
        self.fabric, self.field = fabric, field
        self._schemas: dict[str, dict[str, Schema | None]] = {}
        self._ticks: dict[str, int] = {}
        self._told: set[str] = set()

    def is_of_another_run(self, mail: Mail) -> bool:
        """Return whether the tick goes back, which never happens within one run."""
        tick, last = mail.stamp()[0], self._ticks.get(mail.key, 0)
        if tick >= 0:
            self._ticks[mail.key] = tick
        return 0 <= tick < last

    def line(self, mail: Mail, as_json: bool) -> str | None:
        """Return one message as a line, with units; None if it is no agent's value."""
        chunks = mail.key.split("/")
        if len(chunks) != 4:
            return None
        try:
            schema = self._schema("/".join(chunks[:3]), chunks[3], mail.schema)
            found = schema.decode(mail.payload).describe()
        except RemsError as error:
            if mail.key not in self._told:  # once: any program can put anything
                warn(printable(f"{self._short(mail.key)}: {error}"))
            self._told.add(mail.key)
            return None
        found = {p: v for p, v in found.items() if fnmatchcase(p, self.field)}
        tick, time, *_ = mail.stamp()
        if as_json:
            plain: dict[str, Any] = {"key": mail.key, "tick": tick}
            return json.dumps({**plain, "time": time, "values": found})
        when = f"{time:9.3f} s" if tick >= 0 else "        now"
        shown = "  ".join(f"{path}={show_value(v)}" for path, v in found.items())
        return f"{when}  {self._short(mail.key)}  {shown}"

    def _short(self, key: str) -> str:
        return short_key(key, self.fabric.session.fabric)

    def _schema(self, agent: str, port: str, name: str) -> Schema:
        """Return the schema `name@digest` of a port; look it up if it is new."""
        key, digest = f"{agent}/{port}", name.rpartition("@")[2]
        known = self._schemas.setdefault(key, {})
        if digest not in known and len(known) < MOST:
            # Look it up once: an unknown one would be looked up at every message.
            known[digest] = None
            for other, schema in self.fabric.schemas(self._short(agent)).items():
                learnt = self._schemas.setdefault(f"{agent}/{other}", {})
                learnt[schema.digest] = schema
                if other == port and not digest:
                    learnt[""] = schema  # a plain program names no schema
        found = known.get(digest)
        if found is None:
            raise FabricError(f"{agent} does not tell the schema of its {port}.")
        return found


def _processes(fabric: Fabric, *, or_none: bool = False) -> set[str]:
    """Return the processes of the run. Raises FabricError if there is none.

    or_none: return an empty set instead
    """
    try:
        return {agent["host"] for agent in fabric.agents()}
    except FabricError:
        if not or_none:
            raise
        return set()
