"""Access: who may do what at which keys of a router with users. One table.

The router itself refuses the rest, by Zenoh's access control: it is dropped there, and
reaches nobody. Zenoh does not tell the sender.
"""

from collections.abc import Iterator, Mapping, Sequence

from rems_net.router.keys import FABRIC

#: Chunks that begin with `@`. Zenoh matches them by neither `*` nor `**`, so that each
#: has to be named here.
MACHINERY = (
    "@age",
    "@alive",
    "@call",
    "@crowd",
    "@file",
    "@holds",
    "@join",
    "@lease",
    "@leave",
    "@member",
    "@release",
    "@run",
    "@schema",
    "@start",
    "@step",
    "@stopped",
    "@version",
    "@where",
    "@why",
)


def below(start: str = "") -> tuple[str, ...]:
    """All keys that begin with this; all there are, where it is nothing."""
    return tuple(f"{start}{end}" for end in ("**", *(f"**/{c}/**" for c in MACHINERY)))


EVERYTHING = below()

MEMBERS, GUESTS = "members", "guests"
#: the team in a class list that may do everything
TEACHERS = "teachers"
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

#: asked of the router with a user's name: his role, his team, the class's fabric
WHO = "@rems/who"

#: Who may send what at which keys; what no row allows is refused. A key with a star
#: is allowed where all the keys that it matches are.
TABLE: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    (MEMBERS, ANYTHING, EVERYTHING),
    (GUESTS, WATCH, tuple(key for key in EVERYTHING if "@step" not in key)),
    (GUESTS, ASK, ("**", "**/@schema/**", "**/@where/**", "**/@why", "**/@age")),
    (GUESTS, ASK, ("**/@stopped",)),
    (GUESTS, ASK, ("*/robot/*/@call/*", "*/robot/*/@lease")),
    (GUESTS, PUT, ("*/robot/*/command", "*/stop")),
)
#: what every user may, to know which fabrics and robots are there
PRESENCE = ("*/clock/@alive", "*/robot/*/@alive")
ALL_MAY = ((("liveliness_query",), PRESENCE),)


def team_may(team: str, fabric: str) -> Iterator[tuple[tuple[str, ...], Sequence[str]]]:
    """What a team may: everything on fabrics named for it; on the class's, what guests
    may; and nothing else.
    """
    yield ANYTHING, (*below(f"{team}/"), *below(f"{team}-$*/"))
    for role, what, keys in TABLE:
        if role == GUESTS:
            # `*` is any fabric, and `**/` any beginning.
            there = (key.removeprefix("*/") for key in keys)
            yield what, [f"{fabric}/{key}" for key in there]


def haste(fabric: str) -> list[dict[str, object]]:
    """Zenoh's `qos/network` of a shared router; fabric: the class's own.

    STOP and commands pass all else, and wait for nobody who reads nothing; what else
    is as urgent is not, since it could stand in their way. Nor do the answers wait for
    who asks the class's robots, which go as the question does.
    """
    asked = [
        key.removeprefix("*/")
        for role, what, keys in TABLE
        for key in keys
        if role == GUESTS and what == ASK
    ]
    rules: tuple[dict[str, object], ...] = (
        {
            "messages": ["put", "delete", "query"],
            "key_exprs": [*EVERYTHING],
            "qos": {"priority": "real_time"},
            "overwrite": {"priority": "interactive_high"},
        },
        {
            "messages": ["put"],
            "key_exprs": ["*/stop", "*/robot/*/command"],
            "overwrite": {"priority": "real_time", "congestion_control": "drop"},
        },
        {
            "messages": ["query"],
            "key_exprs": [f"{fabric}/{key}" for key in asked],
            "overwrite": {"congestion_control": "drop"},
        },
    )
    return [
        {"id": f"haste {i}", "flows": ["ingress"], **rule}
        for i, rule in enumerate(rules)
    ]


def is_of_team(team: str, fabric: str) -> bool:
    """Whether `fabric` is one of this team."""
    return f"{fabric}-".startswith(f"{team}-")


def to_wire(
    names: Mapping[str, Sequence[str]],
    teams: Mapping[str, Sequence[str]] | None = None,
    fabric: str = FABRIC,
) -> dict[str, object]:
    """Zenoh's `access_control` for these names of users, by role and by team.

    fabric: the class's own.
    """
    # A subject without names would be everybody.
    subjects = {role: list(names[role]) for role in ROLES if names.get(role)}
    subjects |= {f"team {t}": list(users) for t, users in (teams or {}).items()}
    may: dict[str, list[tuple[tuple[str, ...], Sequence[str]]]] = {
        who: [*ALL_MAY] for who in subjects
    }
    for role, what, keys in TABLE:
        if role in may:
            may[role].append((what, keys))
    for team in teams or {}:
        may[f"team {team}"] += team_may(team, fabric)
    # Each user asks for his own standing, and learns of no other user.
    for user in [user for group in subjects.values() for user in group]:
        subjects[f"user {user}"] = [user]
        may[f"user {user}"] = [(ASK, (f"{WHO}/{user}",))]
    rules: list[dict[str, object]] = [
        {
            "id": f"{who} {i}",
            "permission": "allow",
            "flows": ["ingress"],
            "messages": list(what),
            "key_exprs": list(keys),
        }
        for who, allowed in may.items()
        for i, (what, keys) in enumerate(allowed)
    ]
    # To be told is never refused: who may read at all is said by the rules above.
    told = {
        "id": "told",
        "permission": "allow",
        "flows": ["egress"],
        "messages": list(ANYTHING),
        "key_exprs": [*EVERYTHING, f"{WHO}/*"],
    }
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*rules, told],
        "subjects": [{"id": who, "usernames": n} for who, n in subjects.items()],
        "policies": [
            {
                "subjects": [who],
                "rules": ["told", *(f"{who} {i}" for i in range(len(allowed)))],
            }
            for who, allowed in may.items()
        ],
    }
