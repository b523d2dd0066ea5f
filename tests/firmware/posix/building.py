"""Building the Woodbot's firmware as a process: with CMake, over zenoh-pico."""

import shutil
import subprocess
from pathlib import Path

from tests.commands import finished
from tests.firmware.compiling import FIRMWARE

SOURCE = FIRMWARE / "posix"
NAME = "woodbot-posix"


def missing() -> str:
    """What is missing here for trying at all; empty if nothing."""
    if shutil.which("cmake") is None:
        return "There is no cmake here."
    if not any(map(shutil.which, ("cc", "gcc", "clang"))):
        return "There is no C compiler here: cc, gcc and clang are not found."
    return ""


def build(folder: Path) -> tuple[Path, str]:
    """The program; or what CMake says is missing. Raises RuntimeError if it fails.

    Where zenoh-pico is installed the environment's CMAKE_PREFIX_PATH says.
    """
    made = folder / NAME
    configured = _run("cmake", "-S", str(SOURCE), "-B", str(folder))
    if configured.returncode:
        if "zenoh-pico" not in configured.stderr:
            raise RuntimeError(configured.stderr)
        return made, f"CMake: {' '.join(configured.stderr.split())}"
    built = _run("cmake", "--build", str(folder))
    if built.returncode or "warning:" in built.stderr:
        raise RuntimeError(f"{built.stdout}{built.stderr}")
    return made, ""


def _run(*words: str) -> subprocess.CompletedProcess[str]:
    return finished(words, seconds=600)
