"""Remembered: the class router that this user has joined, until he leaves it."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from pathlib import Path

from rems_net.errors import FabricError

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
    try:
        with path().open("rb") as file:
            told = json.loads(file.read(LONGEST))["router"]
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    return told if isinstance(told, str) else ""


def remember(endpoint: str) -> None:
    """Use this router from now on. Raises FabricError where it can't be kept."""
    file = path()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        new = file.with_suffix(".new")
        new.write_text(json.dumps({"router": endpoint}) + "\n", encoding="utf-8")
        new.replace(file)
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
