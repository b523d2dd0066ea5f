"""Compiling the firmware's C for a test; skips in words where nothing can."""

import shutil
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.commands import finished

FIRMWARE = Path(__file__).parent.parent.parent / "firmware" / "esp32_woodbot"
CORE = FIRMWARE / "core"
STRICT = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-pedantic"]
SANITIZE = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def compiler(*names: str) -> str:
    """The first of these that is installed; of any C compiler, if none is named."""
    names = names or ("cc", "gcc", "clang")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip(f"There is no C compiler here: {', '.join(names)} is not found.")
    return found


def build(words: Iterable[str | Path], made: Path) -> Path:
    """Run a compiler that makes this file; what it complains about fails the test."""
    command = [*map(str, words), "-o", str(made)]
    done = finished(command, seconds=600)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr}"
    return made


def library(sources: Iterable[Path], made: Path) -> Path:
    """A shared library for ctypes: undefined behaviour ends the process."""
    flags = ["-O1", "-g", "-shared", "-fPIC", "-fvisibility=default"]
    undefined = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
    words = [compiler(), *STRICT, *flags, *undefined, f"-I{CORE}"]
    return build([*words, *map(str, sources), "-lm"], made)
