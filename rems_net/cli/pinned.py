"""Pinned: a direct run in a process that computes as those of `rems run` do."""

import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

#: libraries whose last digits depend on the processor, in the text of an experiment;
#: `rems_net.maths` is not among them
_DEPENDS = re.compile(r"mujoco|pybullet|numpy|scipy|(?<!rems_net\.)\bmath\b", re.I)
_DIRECT = re.compile(r"^\s*direct\s*=\s*true\b", re.MULTILINE)
#: files of classes that an experiment's file names
_FILES = re.compile(r"[\w./-]+\.py\b")
#: the variable that marks a process that was started again
MARK = "REMS_PINNED"


def start_pinned(words: Sequence[str]) -> None:
    """Start this command again, pinned, if it needs that; otherwise return.

    words: of the command line, from `run` or `rerun` on; a rerun is always pinned.
    What a process computes with is settled when it starts. Only Linux can pin a
    process; there the new one has the number, the terminal and the exit status of
    this one.
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
    """Return what is in a file; "" if it cannot be read, which is refused later."""
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
