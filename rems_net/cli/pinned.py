"""Pinned processes: a direct run computes the same digits as a run of processes."""

import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

#: libraries whose last digits depend on the processor, if an experiment's text names
#: them; `rems_net.maths` is not among them
_DEPENDS = re.compile(r"mujoco|pybullet|numpy|scipy|(?<!rems_net\.)\bmath\b", re.I)
_DIRECT = re.compile(r"(?:^|[{,])\s*direct\s*=\s*true\b", re.MULTILINE)
#: files of classes, in an experiment's file
_FILES = re.compile(r"[\w./-]+\.py\b")
#: variable that marks a process that was started again
MARK = "REMS_PINNED"


def start_pinned(words: Sequence[str]) -> None:
    """Start this command again, pinned, if it needs that; otherwise return.

    words: of the command line, from `run` or `rerun` on; a rerun is always pinned. A
    process chooses its mathematics when it starts. Only Linux can pin a process; the
    new process keeps this one's number, terminal and exit status.
    """
    if sys.platform != "linux" or "--native" in words or MARK in os.environ:
        return
    if words[:1] == ["rerun"]:
        _start_again()
        return
    file = next((Path(w) for w in words if w.endswith((".py", ".toml"))), Path())
    text = _text(file)
    if not ("--direct" in words or (file.suffix == ".toml" and _DIRECT.search(text))):
        return
    if file.suffix == ".toml":
        text += "".join(_text(file.parent / name) for name in _FILES.findall(text))
    if _DEPENDS.search(text):
        _start_again()


def _start_again() -> None:
    """Start this process again with the variables that pin it, if it has not them."""
    from rems_net.maths.numerics import describe, environment

    if not describe().endswith("pinned"):
        made = environment(os.environ) | {MARK: "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], made)


def _text(file: Path) -> str:
    """Return a file's text; "" if it cannot be read, which is refused later."""
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
