"""`rems watch KEY`: values as they change, one line per message."""

import argparse
import json
from collections.abc import Set
from fnmatch import fnmatchcase
from typing import Any

from rems_net.cli.options import add_at, short_key, show_value, warn
from rems_net.client import Fabric, join
from rems_net.client.watcher import Watcher
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


def add(parser: argparse.ArgumentParser) -> None:
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
        processes = {agent["host"] for agent in fabric.agents()}
        if not fabric.get(key):
            raise fabric.nothing_at(key)
        watcher = Watcher(fabric)
        lines = Lines(watcher, field)
        fabric.session.watch(port, box)
        while left is None or left > 0:
            mail = box.get(SILENCE)
            # Another run may have taken the port of this one; and any program can put a
            # tick of its own.
            doubt = not isinstance(mail, Mail) or watcher.is_of_another_run(mail)
            if doubt and _has_ended(fabric, processes):
                warn("the fabric has ended.")
                return 0
            line = lines.line(mail, args.json) if isinstance(mail, Mail) else None
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


class Lines:
    """Conversion of messages into lines."""

    def __init__(self, watcher: Watcher, field: str):
        self._watcher, self._field = watcher, field
        self._told: set[str] = set()

    def line(self, mail: Mail, as_json: bool) -> str | None:
        """Return one message as a line, with units; None if it is no agent's value."""
        chunks = mail.key.split("/")
        if len(chunks) != 4:
            return None
        short = short_key(mail.key, self._watcher.fabric.session.fabric)
        agent, _, port = short.rpartition("/")
        try:
            schema = self._watcher.schema(agent, port, mail.schema)
            if schema is None:
                raise FabricError(
                    f"{agent} does not send the schema of its {port}. Type: "
                    f"rems why {agent} (R0602)"
                )
            found = schema.decode(mail.payload).describe()
        except RemsError as error:
            if mail.key not in self._told:  # once: any program can put anything
                warn(printable(f"{short}: {error}"))
            self._told.add(mail.key)
            return None
        found = {p: v for p, v in found.items() if fnmatchcase(p, self._field)}
        tick, time, *_ = mail.stamp()
        if as_json:
            plain: dict[str, Any] = {"key": mail.key, "tick": tick}
            return json.dumps({**plain, "time": time, "values": found})
        when = f"{time:9.3f} s" if tick >= 0 else "        now"
        shown = "  ".join(f"{path}={show_value(v)}" for path, v in found.items())
        return f"{when}  {short}  {shown}"


def _has_ended(fabric: Fabric, processes: Set[str]) -> bool:
    """Return whether none of the run's processes is there any more."""
    try:
        return not processes & {agent["host"] for agent in fabric.agents()}
    except FabricError:
        return True
