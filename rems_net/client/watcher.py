"""Watcher: the schemas of watched ports; `rems watch` and the page share it.

Each schema is looked up once. Any program can put a value with an unknown schema, so
the number of look-ups for one port is bounded.
"""

from collections.abc import Callable, Mapping

from rems_net.client.fabric import Fabric
from rems_net.defdict import Schema
from rems_net.router.mail import Mail

#: schemas of one port, at most, that are looked up
MOST = 8


class Watcher:
    """Schemas of the ports of a fabric, and the newest tick of each.

    ask: returns the schemas of an agent's ports; by default it waits for a busy one
    """

    def __init__(
        self,
        fabric: Fabric,
        ask: Callable[[str], Mapping[str, Schema]] | None = None,
    ):
        self.fabric, self._ask = fabric, ask or fabric.schemas
        self._schemas: dict[str, dict[str, Schema | None]] = {}
        self._ticks: dict[str, int] = {}

    def is_of_another_run(self, mail: Mail) -> bool:
        """Return whether the tick goes back, which never happens within one run."""
        tick, last = mail.stamp()[0], self._ticks.get(mail.key, 0)
        if tick >= 0:
            self._ticks[mail.key] = tick
        return 0 <= tick < last

    def schema(self, agent: str, port: str, name: str) -> Schema | None:
        """Return the schema `name@digest` of a port; None if no agent has it.

        agent: its key without the fabric. This asks the agent if the schema is new, and
        may then take seconds. Raises FabricError if the agent does not answer.
        """
        key, digest = f"{agent}/{port}", name.rpartition("@")[2]
        known = self._schemas.setdefault(key, {})
        if digest not in known and len(known) < MOST:
            # Look it up once: an unknown one would be looked up at every message.
            known[digest] = None
            for other, schema in self._ask(agent).items():
                learnt = self._schemas.setdefault(f"{agent}/{other}", {})
                learnt[schema.digest] = schema
                if other == port and not digest:
                    learnt[""] = schema  # a plain program names no schema
        return known.get(digest)
