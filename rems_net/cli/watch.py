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
#: seconds of silence after which the fabric is asked whether it is still there
SILENCE = 2.0
#: schemas of one port that are asked for
MOST = 8


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems watch` can be told."""
    parser.add_argument("key", metavar="KEY", help="a key or a glob (quote it)")
    parser.add_argument("--json", action="store_true", help="JSON, one line each")
    parser.add_argument("--count", metavar="N", type=int, help="end after N lines")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Print what comes until Ctrl+C, or until the fabric ends."""
    full_key(args.key)  # a typo is told before anybody is looked for
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
            # Another run may have taken the port of this one meanwhile; and anybody
            # can put a tick of his own.
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
    """The key that is put, and the glob of its fields: a field is not put alone."""
    chunks = key.split("/")
    if "**" in chunks or len(chunks) <= 4:
        return key, "*"
    return "/".join(chunks[:4]), "/".join(chunks[4:])


class Watcher:
    """Turns messages into lines; learns each schema once."""

    def __init__(self, fabric: Fabric, field: str):
        self.fabric, self.field = fabric, field
        self._schemas: dict[str, dict[str, Schema | None]] = {}
        self._ticks: dict[str, int] = {}
        self._told: set[str] = set()

    def is_of_another_run(self, mail: Mail) -> bool:
        """Whether the tick goes back, which it never does in one run."""
        tick, last = mail.stamp()[0], self._ticks.get(mail.key, 0)
        if tick >= 0:
            self._ticks[mail.key] = tick
        return 0 <= tick < last

    def line(self, mail: Mail, as_json: bool) -> str | None:
        """One message, with units; None for what is no value of an agent."""
        chunks = mail.key.split("/")
        if len(chunks) != 4:
            return None
        try:
            schema = self._schema("/".join(chunks[:3]), chunks[3], mail.schema)
            found = schema.decode(mail.payload).describe()
        except RemsError as error:
            if mail.key not in self._told:  # once: anybody can put anything
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
        """The schema `name@digest` of a port; asked for when it is new."""
        key, digest = f"{agent}/{port}", name.rpartition("@")[2]
        known = self._schemas.setdefault(key, {})
        if digest not in known and len(known) < MOST:
            # Once: what nobody knows would be asked for with every message.
            known[digest] = None
            for other, schema in self.fabric.schemas(self._short(agent)).items():
                learnt = self._schemas.setdefault(f"{agent}/{other}", {})
                learnt[schema.digest] = schema
                if other == port and not digest:
                    learnt[""] = schema  # a plain program says no schema
        found = known.get(digest)
        if found is None:
            raise FabricError(f"{agent} does not tell the schema of its {port}.")
        return found


def _processes(fabric: Fabric, *, or_none: bool = False) -> set[str]:
    """The processes of the run. Raises FabricError for no run, unless told."""
    try:
        return {agent["host"] for agent in fabric.agents()}
    except FabricError:
        if not or_none:
            raise
        return set()
