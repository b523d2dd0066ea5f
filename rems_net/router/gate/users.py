"""Users of a router: names and passwords in a TOML file, a table for each role.

  [members]
  anna = "seven green herons"

  [guests]
  team1 = "a cold teapot"

The format is TOML, as for experiments: the library finds a name given twice or a
missing quote, with its line, and a password may contain any character.
"""

import os
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import blake2s
from pathlib import Path
from typing import Any

from rems_net.errors import ExperimentError, FabricError, nearest
from rems_net.router import notes
from rems_net.router.gate.access import MEMBERS, ROLES
from rems_net.router.keys import check_name
from rems_net.system.reading import DESCRIPTION, decoded, read_file
from rems_net.toml import TOMLDecodeError, loads

#: characters of a password: short ones can be guessed after listening on the network
SHORTEST, LONGEST = 8, 128
#: users of one router
MOST = 1000
#: name of the person at the router's machine; no listed user can have it
OWNER = "_here"


@dataclass(frozen=True, slots=True)
class Users:
    """Users by role, and by team. No output shows the passwords."""

    names: Mapping[str, list[str]]
    passwords: Mapping[str, str] = field(repr=False)
    teams: Mapping[str, list[str]] = field(default_factory=dict)

    @property
    def count(self) -> str:
        """`1 member, 12 guests`; of a class `24 students in 8 teams, 1 teacher`."""
        if self.teams:
            students = sum(len(names) for names in self.teams.values())
            return (
                f"{_many(students, 'students')} in {_many(len(self.teams), 'teams')}, "
                f"{_many(len(self.names[MEMBERS]), 'teachers')}"
            )
        return ", ".join(_many(len(self.names[role]), role) for role in ROLES)

    def identities(self) -> dict[str, tuple[str, str]]:
        """Return role and team of every user, by name; a team's role is ""."""
        of = {n: (role, "") for role in ROLES for n in self.names[role]}
        return of | {n: ("", team) for team, names in self.teams.items() for n in names}

    def with_owner(self) -> "tuple[Users, str, str]":
        """Return these users and one for the router's machine; its name, its password.

        The password is derived from the members' passwords, so that it is still valid
        after a restart of the router.
        """
        members = self.names[MEMBERS]
        secrets = "\n".join(
            f"{name}:{self.passwords[name]}" for name in sorted(members)
        )
        password = blake2s(secrets.encode(), person=b"here").hexdigest()
        names = {**self.names, MEMBERS: [*members, OWNER]}
        passwords = {**self.passwords, OWNER: password}
        return Users(names, passwords, self.teams), OWNER, password


def _many(count: int, what: str) -> str:
    return f"{count} {what if count != 1 else what[:-1]}"


def load(path: Path | str) -> Users:
    """Read the users of a router. Raises FabricError, without any password."""
    path = Path(path)
    tables = _read(path)
    names: dict[str, list[str]] = {role: [] for role in ROLES}
    passwords: dict[str, str] = {}
    for role, table in tables.items():
        if role not in ROLES or not isinstance(table, dict):
            raise FabricError(
                f"{path}: {role!r} is no role; expected the tables "
                f"{' and '.join(f'[{r}]' for r in ROLES)}, and in each a line for each "
                f'user, such as anna = "seven green herons".{nearest(role, ROLES)}'
                " (R0608)"
            )
        for name, password in table.items():
            if name in passwords:
                raise FabricError(
                    f"{path}: {name!r} is in two tables; expected one. Remove "
                    "one of its lines. (R0608)"
                )
            check_user(path, name, password)
            names[role].append(name)
            passwords[name] = password
    if not names[MEMBERS] or len(passwords) > MOST:
        raise FabricError(
            f"{path} has {len(names[MEMBERS])} members among {len(passwords)} users; "
            f"expected at least 1, who can run experiments, and at most {MOST} users. "
            'Write below [members] a line such as anna = "seven green herons". (R0608)'
        )
    return Users(names, passwords)


def _read(path: Path) -> dict[str, Any]:
    text = text_of(path)
    check_private(path)
    try:
        return loads(text)
    except TOMLDecodeError as error:
        # The library's message may quote a password.
        at = str(error).rpartition(" (at ")[2].rstrip(")")
        raise FabricError(
            f"{path}, {at}: this is no TOML; expected a line such as "
            'anna = "seven green herons". (R0608)'
        ) from None


def text_of(path: Path, how: str = "") -> str:
    """Return the text of a users file; how: to save it as UTF-8. Raises FabricError."""
    try:
        return decoded(read_file(path, DESCRIPTION))
    except FileNotFoundError:
        here = [p.name for p in path.parent.glob(f"*{path.suffix}")]
        hint = nearest(path.name, here)
        raise FabricError(f"There is no file {path}.{hint} (R0608)") from None
    except UnicodeDecodeError:
        raise FabricError(
            f"{path} is no text in UTF-8; save it as UTF-8{how}. (R0608)"
        ) from None
    except OSError as error:
        raise FabricError(f"Cannot read {path}: {error.strerror}. (R0608)") from None


def check_user(path: Path, name: str, password: object) -> None:
    """Raise FabricError for an invalid name or password."""
    try:
        check_name(name, "the name of a user")
    except ExperimentError as error:
        raise FabricError(f"{path}: {error}") from None
    whole = isinstance(password, str) and password.isprintable()
    if not (
        isinstance(password, str)
        and whole
        and SHORTEST <= len(password) <= LONGEST
        and password == password.strip()
    ):
        raise FabricError(
            f"{path}: the password of {name!r} can't be used; expected {SHORTEST} to "
            f"{LONGEST} letters in quotes, with no blank at the ends. (R0608)"
        )


def check_private(path: Path) -> None:
    """Raise FabricError for a file that other users of this machine can use."""
    mode = path.stat().st_mode
    if hasattr(os, "getuid") and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise FabricError(
            f"{path} holds passwords, and other users of this machine can use "
            f"it (mode {stat.S_IMODE(mode):o}). Type: chmod 600 {path} (R0608)"
        )


@contextmanager
def dictionary(users: Users | None) -> Iterator[str]:
    """Yield a file of the passwords for Zenoh, which reads it at its start; or ""."""
    if users is None:
        yield ""
        return
    handle, name = tempfile.mkstemp(prefix=".", dir=notes.folder())
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.writelines(f"{n}:{p}\n" for n, p in users.passwords.items())
        yield name
    finally:
        Path(name).unlink(missing_ok=True)
