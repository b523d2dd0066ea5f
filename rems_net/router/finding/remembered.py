"""Remembered: the class router that this user has joined, until he leaves it.

With his name and password, where it has users: so nobody else can read the file.
"""

import getpass
import json
import os
import platform
import re
import sys
from contextlib import suppress
from pathlib import Path

from rems_net.errors import FabricError
from rems_net.router.keys import FABRIC, is_name
from rems_net.router.notes import write_own

#: bytes of the longest file that is read
LONGEST = 4096


def path() -> Path:
    """The file that remembers it, among the settings of this user."""
    if sys.platform == "win32":
        base = os.environ.get("APPDATA") or str(Path.home() / "AppData" / "Roaming")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / "rems_net" / "router.json"


def router() -> str:
    """The endpoint of the router that was joined; nothing where none was."""
    return _read().get("router", "")


def fabric() -> str:
    """The name of this user's own fabric at that router."""
    return _read().get("fabric", "") or usual_fabric()


def credentials() -> tuple[str, str]:
    """The name and the password that he joined with; or two empty texts."""
    kept = _read()
    return kept.get("user", ""), kept.get("password", "")


def usual_fabric() -> str:
    """A name that a class will hardly have twice: of the user and his laptop."""
    with suppress(Exception):  # nobody says what it raises on which system
        name = f"{getpass.getuser()}-{platform.node().partition('.')[0]}"
        made = re.sub("[^A-Za-z0-9_.-]", "_", name).lstrip("_.-")[:63]
        if is_name(made) and made != FABRIC:
            return made
    return "nobody"


def _read() -> dict[str, str]:
    try:
        with path().open("rb") as file:
            told = json.loads(file.read(LONGEST))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(told, dict):
        return {}
    return {k: v for k, v in told.items() if isinstance(v, str)}


def remember(
    endpoint: str, fabric: str = "", user: str = "", password: str = ""
) -> None:
    """Use this router from now on. Raises FabricError where it can't be kept."""
    file = path()
    kept = {"router": endpoint, "fabric": fabric or usual_fabric()}
    if user:
        kept |= {"user": user, "password": password}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_own(file, json.dumps(kept) + "\n")
    except OSError as error:
        raise FabricError(
            f"Cannot remember {endpoint} in {file}: {error.strerror or error}. Set "
            f"REMS_ROUTER to {endpoint} instead."
        ) from None


def forget() -> str:
    """Forget it. Returns which it was; nothing where there was none."""
    was = router()
    with suppress(OSError):
        path().unlink()
    return was
