"""Settings of a session, in one frozen value that makes Zenoh's configuration."""

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rems_net.router.finding.address import located
from rems_net.router.gate import access
from rems_net.router.keys import FABRIC
from rems_net.router.mail import MAX_PAYLOAD

if TYPE_CHECKING:
    from rems_net.router.gate.users import Users

#: bytes. A shared router takes a message up to this size: payload and key.
LARGEST = MAX_PAYLOAD + 1_000_000
#: bytes of the system's buffers between Zenoh and the gate in front of it, each way
INSIDE = 65_536


@dataclass(frozen=True, slots=True)
class Link:
    """Settings of a process's membership in a fabric.

    endpoint: a Zenoh endpoint, such as `tcp/127.0.0.1:7447`
    serve: False joins the router at the endpoint as a client; True is that router
    fabric: first chunk of every key
    lease: seconds after which a frozen neighbour counts as gone
    timeout: seconds to wait for the router when joining
    user, password: of a client, at a router that has users
    users: of a router: nobody else is let in, and a role limits what each user may do
    behind: of a shared router: Zenoh's own endpoint, behind the gate at `endpoint`; a
        slow client's link does not delay the others
    """

    endpoint: str
    serve: bool = False
    fabric: str = FABRIC
    lease: float = 2.0
    timeout: float = 2.0
    user: str = ""
    password: str = field(default="", repr=False)
    users: "Users | None" = None
    behind: str = ""

    def to_wire(self, dictionary: str = "") -> str:
        """Return the Zenoh configuration, as JSON; `dictionary`: the users' file.

        The network is always a star: clients of one router at a known endpoint, never a
        mesh (peers reorder messages). Multicast is never used, since most campus Wi-Fi
        filters it.
        """
        lease = round(self.lease * 1000)
        # us. A message that may be dropped waits this long for room. A client waits
        # long, so that only the router drops, for slow readers; the router waits for a
        # moment, since all other clients wait meanwhile.
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
        if self.serve:  # a small buffer reveals a frozen reader sooner
            link["tcp"] = {"so_sndbuf": INSIDE if self.behind else 262_144}
        transport: dict[str, object] = {
            "link": link,
            # A killed process would leave shared memory behind; below 60 KB it gains
            # nothing.
            "shared_memory": {"enabled": False},
        }
        nowhere = {"enabled": False}
        config: dict[str, object] = {
            # A router would wait for others, for half a second, before it opens.
            "scouting": {"multicast": nowhere, "gossip": nowhere, "delay": 0},
            "transport": transport,
        }
        if self.serve:
            config["mode"] = "router"
            config["listen"] = {"endpoints": [self.behind or self.endpoint]}
            # A class of thirty joins within the same second.
            transport["unicast"] = {"accept_pending": 500, "max_sessions": 2000}
            if self.behind:
                # Zenoh's default is 1 GiB for each sender, and it keeps the memory.
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
                "endpoints": [located(self.endpoint)],
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
