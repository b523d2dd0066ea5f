"""Everything a session is told, in one frozen value with one way onto the wire."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rems_net.router.gate import access
from rems_net.router.keys import FABRIC
from rems_net.router.mail import MAX_PAYLOAD

if TYPE_CHECKING:
    from rems_net.router.gate.users import Users

#: bytes of a message that a shared router takes: the largest payload, and its key
LARGEST = MAX_PAYLOAD + 1_000_000
#: bytes that the system keeps between Zenoh and the gate in front of it, each way
INSIDE = 65_536


@dataclass(frozen=True, slots=True)
class Link:
    """How a process joins a fabric.

    endpoint: a Zenoh endpoint, such as `tcp/127.0.0.1:7447`
    serve: False joins the router at the endpoint as a client; True is that router
    fabric: first chunk of every key
    lease: seconds after which a frozen neighbour counts as gone
    timeout: seconds to wait for the router when joining
    user, password: of a client, at a router that has users
    users: of a router: nobody else is let in, and each may do what his role says
    behind: of a router that is shared: where Zenoh listens, behind the gate at the
        endpoint; nobody's link to it holds up those who have no part in it
    """

    endpoint: str
    serve: bool = False
    fabric: str = FABRIC
    lease: float = 2.0
    timeout: float = 2.0
    user: str = ""
    password: str = field(default="", repr=False)
    users: Users | None = None
    behind: str = ""

    def to_wire(self, dictionary: str = "") -> str:
        """The Zenoh configuration, as JSON; `dictionary` is the file of the users.

        Always a star: clients of one router at a known endpoint, never a mesh (peers
        reorder messages). Nothing needs multicast, since most campus Wi-Fi filters it.
        """
        lease = round(self.lease * 1000)
        # What may be dropped waits this long for room, in us. A client's own link is
        # to wait long, so that the router alone drops, for whom is slow; there it is a
        # moment, since all others wait meanwhile.
        wait = 20_000 if self.serve else 2_000_000
        drop = {
            "wait_before_drop": wait,
            "max_wait_before_drop_fragments": max(wait, 50_000),
        }
        link: dict[str, object] = {
            "tx": {
                "lease": lease,
                "keep_alive": 4,
                "queue": {"congestion_control": {"drop": drop}},
            }
        }
        if self.serve:  # a reader that is frozen is known sooner by a small buffer
            link["tcp"] = {"so_sndbuf": INSIDE if self.behind else 262_144}
        transport: dict[str, object] = {
            "link": link,
            # A killed process would leave its segments behind, and below 60 KB
            # shared memory gains nothing.
            "shared_memory": {"enabled": False},
        }
        config: dict[str, object] = {
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
            "transport": transport,
        }
        if self.serve:
            config["mode"] = "router"
            config["listen"] = {"endpoints": [self.behind or self.endpoint]}
            # A class of thirty arrives within the same second.
            transport["unicast"] = {"accept_pending": 500, "max_sessions": 2000}
            if self.behind:
                # Zenoh's own choice is 1 GiB, of each who sends, and kept.
                link["rx"] = {"max_message_size": LARGEST}
                config["qos"] = {"network": access.haste(self.fabric)}
            if self.users is not None:
                transport["auth"] = {"usrpwd": {"dictionary_file": dictionary}}
                users = self.users
                wire = access.to_wire(users.names, users.teams, self.fabric)
                config["access_control"] = wire
        else:
            config["mode"] = "client"
            config["connect"] = {
                "endpoints": [self.endpoint],
                "timeout_ms": round(self.timeout * 1000),
                "retry": {
                    "period_init_ms": 200,
                    "period_max_ms": 1000,
                    "period_increase_factor": 2,
                },
            }
            if self.user:
                known = {"user": self.user, "password": self.password}
                transport["auth"] = {"usrpwd": known}
        return json.dumps(config)
