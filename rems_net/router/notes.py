"""Notes: where the routers of this machine are, in files that only this user writes.

A forged note could lead `rems stop` astray, and in a temporary folder everybody can
write. So the folder belongs to this user alone, and a link or another user's file in it
is refused.
"""

import json
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.errors import FabricError
from rems_net.system.patience import patiently

VARIABLE = "XDG_RUNTIME_DIR"
#: bytes of the longest note
LONGEST = 4096
#: flags: opening follows no link and does not block; 0 on a system without such a flag
_PLAINLY = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
_OTHERS = stat.S_IRWXG | stat.S_IRWXO


class Note(NamedTuple):
    """Address of a router, and its id.

    user, password: of the person at this machine, at a router that has users
    served: made by `rems router serve`, which people restart after a crash
    """

    endpoint: str
    router: str
    user: str = ""
    password: str = ""
    served: bool = False


def folder() -> Path:
    """Return this user's folder for the notes of running routers; a reboot empties it.

    Raises FabricError for a folder that cannot be made, or that others can write.
    """
    given = os.environ.get(VARIABLE)
    try:
        if given:
            base = Path(given)
            base.mkdir(mode=0o700, parents=True, exist_ok=True)
            made = base / "rems_net"
        else:
            made = Path(tempfile.gettempdir()) / f"rems_net{_mark()}"
        with suppress(FileExistsError):
            made.mkdir(mode=0o700)
        status = made.lstat()
    except OSError as error:
        where = f"{VARIABLE} is {given!r}, and" if given else "In the temporary folder,"
        todo = ", or unset it." if given else "."
        raise FabricError(
            f"{where} no folder for the notes of routers can be made there: "
            f"{error.strerror or error}. Set {VARIABLE} to a folder of your own{todo} "
            "(R0612)"
        ) from None
    _check(made, status)
    return made


def _mark() -> str:
    """Return a suffix that keeps users apart in a shared temporary folder."""
    return f"-{os.getuid()}" if hasattr(os, "getuid") else ""


def _check(path: Path, status: os.stat_result) -> None:
    """Raise FabricError if it is not a folder that only this user can use."""
    what, todo = "", f"Remove it, or set {VARIABLE} to a folder of your own."
    if stat.S_ISLNK(status.st_mode):
        what = "is a link"
    elif not stat.S_ISDIR(status.st_mode):
        what = "is no folder"
    elif not _ours(status):
        what = f"belongs to another user (number {status.st_uid})"
        todo = f"Set {VARIABLE} to a folder of your own."
    elif hasattr(os, "getuid") and status.st_mode & _OTHERS:
        what = f"is open to other users (mode {stat.S_IMODE(status.st_mode):o})"
        todo = f"If you know what is in it, type: chmod 700 {path}"
    if what:
        raise FabricError(
            f"{path}, where the notes of running routers are, {what}; expected a "
            f"folder of yours alone. {todo} (R0612)"
        )


def _ours(status: os.stat_result) -> bool:
    return not hasattr(os, "getuid") or status.st_uid == os.getuid()


def write(fabric: str, port: int, note: Note) -> Path:
    """Leave a note of a router; the caller unlinks it. Raises FabricError."""
    path = folder() / f"{fabric}-{port}.json"
    try:
        write_own(path, json.dumps({k: v for k, v in note._asdict().items() if v}))
    except OSError as error:
        raise FabricError(
            f"Cannot write {path}, by which other programs find this fabric: "
            f"{error.strerror or error}. (R0612)"
        ) from None
    return path


def write_own(file: Path, text: str) -> None:
    """Write a file that its owner alone can read, or nothing. Raises OSError.

    The text is written under a new name, and moved then: a reader finds all of it. An
    old file or a link at its place is replaced, never written to.
    """
    handle, name = tempfile.mkstemp(prefix=".", dir=file.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as new:
            new.write(text)
        patiently(lambda: Path(name).replace(file))
    except BaseException:
        with suppress(OSError):
            Path(name).unlink()
        raise


def all_of_them() -> list[Path]:
    """Return the notes of all fabrics, the newest first. Raises FabricError."""
    return sorted(folder().glob("*.json"), key=_age, reverse=True)


def find(fabric: str) -> list[Path]:
    """Return the notes of a fabric's routers, the newest first. Raises FabricError."""
    # `rems-lab-7447` is a note of `rems-lab`, and not of `rems`.
    return [n for n in all_of_them() if n.stem.rpartition("-")[0] == fabric]


def _age(note: Path) -> float:
    try:
        return note.lstat().st_mtime
    except OSError:
        return 0.0


def read(note: Path) -> Note | None:
    """Return the content of a note; None if it is malformed.

    Raises FabricError for another user's file: it must not lead this user anywhere.
    """
    told = _load(note)
    try:
        where = str(told["endpoint"]), str(told["router"])
    except KeyError:
        return None
    user, password = str(told.get("user", "")), str(told.get("password", ""))
    return Note(*where, user, password, told.get("served") is True)


def _load(note: Path) -> dict[str, Any]:
    try:
        handle = os.open(note, os.O_RDONLY | _PLAINLY)
    except FileNotFoundError:
        return {}
    except OSError as error:
        if note.is_symlink():
            raise _foreign(note, "is a link") from None
        raise _foreign(note, f"cannot be read ({error.strerror})") from None
    with os.fdopen(handle, "rb") as file:
        status = os.fstat(handle)
        if not stat.S_ISREG(status.st_mode):
            raise _foreign(note, "is no file")
        if not _ours(status):
            raise _foreign(note, f"belongs to another user (number {status.st_uid})")
        text = file.read(LONGEST + 1)
    try:
        told = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return told if isinstance(told, dict) else {}


def _foreign(note: Path, what: str) -> FabricError:
    return FabricError(
        f"{note} {what}, so it is not believed; expected a note that a run of yours "
        f"has left. Remove {note} (R0612)"
    )
