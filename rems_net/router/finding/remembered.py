"""The class router that this user has joined, stored until they leave it.

With a user name and password, if it has users: so only its owner can read the file.
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
    """Return the file that stores it, among the settings of this user."""
    if sys.platform == "win32":
        base = os.environ.get("APPDATA") or str(Path.home() / "AppData" / "Roaming")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(base) / "rems_net" / "router.json"


def router() -> str:
    """Return the endpoint of the joined router, or ""."""
    return _read().get("router", "")


def fabric() -> str:
    """Return the name of this user's own fabric at that router."""
    return _read().get("fabric", "") or usual_fabric()


def credentials() -> tuple[str, str]:
    """Return the user name and password for it; or two empty strings."""
    kept = _read()
    return kept.get("user", ""), kept.get("password", "")


def usual_fabric() -> str:
    """Return a name that is probably unique in a class: of user and laptop."""
    with suppress(Exception):  # the errors differ between systems
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
    """Use this router from now on. Raises FabricError if it cannot be stored."""
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
            f"REMS_ROUTER to {endpoint} instead. (R0612)"
        ) from None


def forget() -> str:
    """Forget the router. Return which it was, or ""."""
    was = router()
    with suppress(OSError):
        path().unlink()
    return was
