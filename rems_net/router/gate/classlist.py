"""Class list: a teacher's table of names and teams, and passwords.

    name,team
    Anna Berg,team1
    Ben Cho,team1

Missing passwords are made, and stored in slips to be printed: one file beside the list,
which only its owner can read. The next time they are read from there.
"""

import csv
import io
import re
import secrets
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rems_net.errors import FabricError
from rems_net.router.gate.access import GUESTS, MEMBERS, TEACHERS, is_of_team
from rems_net.router.gate.users import MOST, Users, check_private, check_user, text_of
from rems_net.router.keys import LONGEST, is_name
from rems_net.router.notes import write_own

#: columns of the table; the last one is optional
COLUMNS = "name", "team", "password"
#: letters of passwords: none that look alike
_LETTERS = "23456789abcdefghjkmnpqrstvwxyz"
_SLIP = re.compile(r"--user (\S+)\r?\n +password: ([^\r\n]+)")
_CUT = f"{'-' * 64}\n"
#: letters whose Unicode names do not contain the letters of a to z that replace them
_OTHER = str.maketrans(
    {"ð": "d", "þ": "th", "ə": "e", "ŋ": "ng", "\u0131": "i"}  # the last has no dot
)
#: Unicode names of letters that it does not decompose: ø, æ, œ, ɛ
_LATIN = re.compile(
    r"LATIN SMALL (?:LETTER|LIGATURE) (?:OPEN )?([A-Z]{1,2})(?: WITH .*)?"
)


class Row(NamedTuple):
    """One line of the list. user, team: as people type them."""

    line: int
    name: str
    user: str
    team: str
    password: str


def slips_of(path: Path) -> Path:
    """Return the path of a class list's slips."""
    return path.with_suffix(".slips.txt")


def load_class(path: Path, fabric: str, address: str = "ADDRESS") -> Users:
    """Read a class list, and write its slips. Raises FabricError, with no password.

    fabric: the class's own, which all may look at.  address: the router's, for the
    slips.
    """
    rows = list(_rows(path))
    if not rows:
        raise FabricError(
            f"{path} has no names in it; expected the columns name and team, and below "
            "them a line for each user, such as: Anna Berg,team1 (R0607)"
        )
    if any(row.password for row in rows):
        check_private(path)
    if not any(row.team == TEACHERS for row in rows):
        rows.append(Row(0, "Teacher", "teacher", TEACHERS, ""))
    _check(path, rows, fabric)
    slips = slips_of(path)
    known = _read(slips)
    rows = [
        row._replace(password=row.password or known.get(row.user) or _made())
        for row in rows
    ]
    teams: dict[str, list[str]] = {}
    for row in rows:
        check_user(path, row.user, row.password)
        teams.setdefault(row.team, []).append(row.user)
    _write(slips, path, rows, address)
    members = teams.pop(TEACHERS)
    names = {MEMBERS: members, GUESTS: []}
    return Users(names, {row.user: row.password for row in rows}, teams)


def _rows(path: Path) -> Iterator[Row]:
    text = text_of(path, " (Excel: as 'CSV UTF-8')")
    columns: list[str] = []
    for line, words in _lines(path, text):
        where = f"{path}, line {line}"
        if not columns:
            columns = [word.lower() for word in words]
            if sorted(columns) not in (sorted(COLUMNS[:2]), sorted(COLUMNS)):
                raise FabricError(
                    f"{where}: its columns are {', '.join(columns) or 'none'}; "
                    "expected name, team, and password where you choose them yourself."
                    " (R0607)"
                )
            continue
        if len(words) > len(columns):
            raise FabricError(
                f"{where} has {len(words)} cells, and there are {len(columns)} "
                'columns; write a name with a comma in quotes: "Berg, Anna". (R0607)'
            )
        told = dict(zip(columns, words, strict=False))
        name, team = told.get("name", ""), told.get("team", "")
        if not name:
            raise FabricError(
                f"{where}: it has a team and no name; write one, or remove the line."
                " (R0607)"
            )
        if not team:
            raise FabricError(
                f"{where}: {name!r} has no team; write one into each line, as in the "
                "first. (R0607)"
            )
        for what, word in (("name", name), ("team", team)):
            if not word.isprintable() or (what == "team" and not typed(word)):
                raise FabricError(
                    f"{where}: its {what} is {word!r}; expected one with letters from "
                    "a to z, or digits, such as 'Anna Berg' and 'team1'. (R0607)"
                )
        yield Row(line, name, typed(name), typed(team), told.get("password", ""))


def _lines(path: Path, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each line that is not empty, by number, with its cells."""
    lines = list(io.StringIO(text, newline=""))  # a cell may contain several lines
    if lines and lines[0].lower().startswith("sep="):  # for Excel; of no column
        lines[0] = "\n"
    first = next((line for line in lines if line.strip()), "")
    mark = max(",;\t", key=first.count)
    reader = csv.reader(lines, delimiter=mark, strict=True)
    try:
        for cells in reader:
            words = [_visible(cell) for cell in cells]
            while words and not words[-1]:
                words.pop()
            if words:
                yield reader.line_num, words
    except csv.Error as error:
        what = "a quote is open" if "end of data" in str(error) else error
        raise FabricError(
            f"{path}, line {reader.line_num}: this is no table: {what}. (R0607)"
        ) from None


def _visible(cell: str) -> str:
    """Return the words of a cell, without invisible formatting characters."""
    seen = (letter for letter in cell if unicodedata.category(letter) != "Cf")
    return " ".join("".join(seen).split())


def typed(name: str) -> str:
    """Return the user name for a name, such as `anna.berg`; "" if there is none.

    Accents are removed, and any character but a to z, digits, `_` and `-` becomes a
    dot.
    """
    plain = unicodedata.normalize("NFKD", name.casefold()).translate(_OTHER)
    word = "".join(
        _plain(letter) for letter in plain if not unicodedata.combining(letter)
    )
    word = re.sub(r"[^a-z0-9_.-]+", ".", word).strip("._-")
    word = word[:LONGEST].rstrip("._-")
    return word if is_name(word) else ""


def _plain(letter: str) -> str:
    if unicodedata.category(letter) == "Pd":  # a dash
        return "-"
    found = _LATIN.fullmatch(unicodedata.name(letter, ""))
    return found[1].lower() if found else letter


def _check(path: Path, rows: list[Row], fabric: str) -> None:
    if unnamed := [row for row in rows if not row.user]:
        lines = ", ".join(f"{row.line} ({row.name})" for row in unnamed)
        raise FabricError(
            f"{path}: names without a letter from a to z can't be typed on every "
            "laptop. Write one beside it, such as '王芳 Wang Fang', in line "
            f"{lines}. (R0607)"
        )
    users: dict[str, Row] = {}
    for row in rows:
        if other := users.get(row.user):
            what = f"lines {other.line} and {row.line} are"
            if not row.line:
                what = f"line {other.line} and the teacher (team {TEACHERS!r}) are"
            raise FabricError(
                f"{path}: {what} both the user {row.user!r}; write an initial "
                "behind one of the names. (R0607)"
            )
        users[row.user] = row
    if len(rows) > MOST:
        raise FabricError(
            f"{path} has {len(rows)} users; expected at most {MOST}. (R0607)"
        )
    teams = sorted({row.team for row in rows} - {TEACHERS})
    for team in teams:
        # Fabrics of a team begin with its name and a dash.
        taken = [fabric, *(name for name in teams if name != team)]
        for name in (one for one in taken if is_of_team(team, one)):
            whose = "the class's fabric" if name == fabric else "another team"
            raise FabricError(
                f"{path}: {team!r} is a team, and {name!r} is {whose}: {team!r} has "
                f"all the fabrics whose names begin with '{team}-'. Give it another "
                "name. (R0607)"
            )


def _made() -> str:
    fours = ("".join(secrets.choice(_LETTERS) for _ in range(4)) for _ in range(3))
    return "-".join(fours)


def _read(slips: Path) -> dict[str, str]:
    """Return the passwords that were made before, by user."""
    if not slips.exists():
        return {}
    check_private(slips)
    return dict(_SLIP.findall(text_of(slips)))


def _write(slips: Path, path: Path, rows: list[Row], address: str) -> None:
    """Write the slips: all or none, and readable by their owner only."""
    text = (
        f"Slips of {path.name}: print them, cut them, hand them out.\nKeep this file, "
        "and keep it to yourself: the passwords are nowhere else.\n"
    )
    for row in rows:
        text += (
            f"{_CUT}{row.name:<47} {row.team}\n  rems router use {address} --user "
            f"{row.user}\n  password: {row.password}\n"
        )
    try:
        write_own(slips, text + _CUT)
    except OSError as error:
        raise FabricError(
            f"Cannot write {slips}, where the passwords of the class are kept: "
            f"{error.strerror or error}. (R0607)"
        ) from None
