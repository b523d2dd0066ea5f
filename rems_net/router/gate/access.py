"""Access: who may do what at which keys of a router with users. One table.

The router itself refuses the rest, by Zenoh's access control: it is dropped there, and
reaches nobody. Zenoh does not tell the sender.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

#: Chunks that begin with `@`. Zenoh matches them by neither `*` nor `**`, so that each
#: has to be named here.
MACHINERY = (
    "@age",
    "@alive",
    "@call",
    "@holds",
    "@join",
    "@leave",
    "@lend",
    "@lent",
    "@member",
    "@release",
    "@run",
    "@schema",
    "@step",
    "@stopped",
    "@where",
    "@why",
)
EVERYTHING = ("**", *(f"**/{chunk}/**" for chunk in MACHINERY))

MEMBERS, GUESTS = "members", "guests"
#: who is what; the order in which they are told
ROLES = {
    MEMBERS: "run experiments: the clock, and the hosts of its agents",
    GUESTS: "read everything, command robots, and stop them",
}

#: what Zenoh calls what is sent, by what it is for
PUT = ("put",)
ASK = ("query",)
WATCH = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
ANSWER = ("declare_queryable", "reply", "liveliness_token", "delete")
ANYTHING = (*PUT, *ASK, *WATCH, *ANSWER)

#: answered by the router to guests alone: how a program learns that it is one
GUEST_KEY = "@rems/guest"

#: Who may send what at which keys; what no row allows is refused. A key with a star
#: is allowed where all the keys that it matches are.
TABLE: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    (MEMBERS, ANYTHING, EVERYTHING),
    (GUESTS, WATCH, EVERYTHING),
    (GUESTS, ASK, ("**", "**/@schema/**", "**/@where/**", "**/@why", "**/@age")),
    (GUESTS, ASK, ("**/@stopped",)),
    (GUESTS, ASK, ("*/robot/*/@call/*", GUEST_KEY)),
    (GUESTS, PUT, ("*/robot/*/command", "*/stop")),
)


def to_wire(names: Mapping[str, Sequence[str]]) -> dict[str, object]:
    """Zenoh's `access_control` for these names of users, by role."""
    rules: list[dict[str, object]] = [
        {
            "id": f"{role} {i}",
            "permission": "allow",
            "flows": ["ingress"],
            "messages": list(what),
            "key_exprs": list(keys),
        }
        for i, (role, what, keys) in enumerate(TABLE)
    ]
    # To be told is never refused: who may read at all is said by the rules above.
    told = {
        "id": "told",
        "permission": "allow",
        "flows": ["egress"],
        "messages": list(ANYTHING),
        "key_exprs": [*EVERYTHING, GUEST_KEY],
    }
    # A subject without names would be everybody.
    roles = [role for role in ROLES if names.get(role)]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*rules, told],
        "subjects": [{"id": role, "usernames": list(names[role])} for role in roles],
        "policies": [
            {
                "subjects": [role],
                "rules": ["told"]
                + [f"{role} {i}" for i, row in enumerate(TABLE) if row[0] == role],
            }
            for role in roles
        ],
    }
