"""Access rules of a router with users: who may do what at which keys. One table.

The router drops everything else by Zenoh's access control. Zenoh does not inform the
sender.
"""

from collections.abc import Iterator, Mapping, Sequence

from rems_net.router.keys import FABRIC

#: Chunks that begin with `@`. Neither `*` nor `**` of Zenoh matches them, so each is
#: listed.
MACHINERY = (
    "@age",
    "@alive",
    "@call",
    "@crowd",
    "@driver",
    "@event",
    "@file",
    "@holds",
    "@join",
    "@lease",
    "@leave",
    "@lost",
    "@member",
    "@release",
    "@run",
    "@scene",
    "@schema",
    "@settings",
    "@start",
    "@step",
    "@stopped",
    "@version",
    "@where",
    "@why",
)


def below(start: str = "") -> tuple[str, ...]:
    """Return the globs of all keys that begin with this; without it, of all keys."""
    return tuple(f"{start}{end}" for end in ("**", *(f"**/{c}/**" for c in MACHINERY)))


EVERYTHING = below()

MEMBERS, GUESTS = "members", "guests"
#: the team in a class list that may do everything
TEACHERS = "teachers"
#: roles with what they may do, in the order in which they are shown
ROLES = {
    MEMBERS: "run experiments: the clock, and the hosts of its agents",
    GUESTS: "read everything, command robots, and stop them",
}

#: Zenoh's names of messages, by purpose
PUT = ("put",)
ASK = ("query",)
WATCH = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
ANSWER = ("declare_queryable", "reply", "liveliness_token", "delete")
ANYTHING = (*PUT, *ASK, *WATCH, *ANSWER)

#: question to the router with a user's name: role, team, the class's fabric
WHO = "@rems/who"

#: Role, messages, keys: anything that no row allows is refused. A key with a star is
#: allowed if all keys that it matches are.
TABLE: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    (MEMBERS, ANYTHING, EVERYTHING),
    (GUESTS, WATCH, tuple(key for key in EVERYTHING if "@step" not in key)),
    (GUESTS, ASK, ("**", "**/@schema/**", "**/@where/**", "**/@why", "**/@age")),
    (GUESTS, ASK, ("**/@stopped", "**/@driver", "**/@scene")),
    (GUESTS, ASK, ("*/robot/*/@call/*", "*/robot/*/@lease", "*/robot/*/@lease/drive")),
    (GUESTS, ASK, ("*/input/*/@lease/drive",)),
    (GUESTS, PUT, ("*/robot/*/command", "*/input/*/command", "*/stop")),
)
#: what every user may ask: which fabrics and robots are there
PRESENCE = ("*/clock/@alive", "*/robot/*/@alive")
ALL_MAY = ((("liveliness_query",), PRESENCE),)


def team_may(team: str, fabric: str) -> Iterator[tuple[tuple[str, ...], Sequence[str]]]:
    """Yield a team's rights: all on its own fabrics, a guest's on the class's."""
    yield ANYTHING, (*below(f"{team}/"), *below(f"{team}-$*/"))
    for role, what, keys in TABLE:
        if role == GUESTS:
            # `*` is any fabric, and `**/` any beginning.
            there = (key.removeprefix("*/") for key in keys)
            yield what, [f"{fabric}/{key}" for key in there]


def haste(fabric: str) -> list[dict[str, object]]:
    """Return Zenoh's `qos/network` of a shared router; fabric: the class's own.

    STOP and commands overtake all else, and never wait for a client that does not read.
    Other urgent messages get a lower priority, since they could delay STOP. Questions
    to the class's robots are dropped under pressure, and so are the answers, which
    inherit this from the question.
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
    """Return whether `fabric` is one of this team."""
    return f"{fabric}-".startswith(f"{team}-")


def to_wire(
    names: Mapping[str, Sequence[str]],
    teams: Mapping[str, Sequence[str]] | None = None,
    fabric: str = FABRIC,
) -> dict[str, object]:
    """Return Zenoh's `access_control` for these users, by role and by team.

    fabric: the class's own.
    """
    # A subject without names would match everybody.
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
    # Each user may ask for their own identity only.
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
    # Outgoing messages are all allowed: the rules above decide who may subscribe.
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
