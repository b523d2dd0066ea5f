"""Port: the Woodbot as a process over zenoh-pico, if CMake finds zenoh-pico."""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from rems_net.errors import MissingPartError
from rems_net.firmware import build

SOURCES = (
    *("cable/*.[ch]", "core/**/*.[ch]", "pico/*.[ch]", "posix/**/*.[ch]"),
    "pico/options.ini",
    "posix/CMakeLists.txt",
)
NAME = "woodbot-posix"
#: How to do without it.
LIBRARY = "rems board emulate ... --library"
#: Printed if CMake is installed without a build tool: it can't build then.
NO_TOOL = (
    "CMake finds neither make nor ninja, so each robot runs by the shared library. For "
    "robots over zenoh-pico, type: "
)


def program(tell: Callable[[str], None] = lambda _: None) -> Path | None:
    """Return the program, built if need be; None if zenoh-pico is not installed.

    tell: called before it is built, with a sentence.

    CMAKE_PREFIX_PATH gives the place of zenoh-pico. Raises MissingPartError if it is
    there, but the program can't be built.
    """
    if shutil.which("cmake") is None or sys.platform == "win32":
        return None
    folder = build.sources()
    files = sorted(path for glob in SOURCES for path in folder.glob(glob))
    made = build.cache() / f"{NAME}-{build.digest(files)}"
    if not made.exists() and not _build(folder / "posix", made, tell):
        return None
    return made


def _build(source: Path, made: Path, tell: Callable[[str], None]) -> bool:
    """Build it, and return whether there is a zenoh-pico."""
    with build.beside(made, f", or without zenoh-pico: {LIBRARY}") as folder:
        configured = build.run("cmake", "-S", str(source), "-B", str(folder))
        if "zenoh-pico is not installed" in configured.stderr:
            return False
        if "CMAKE_MAKE_PROGRAM is not set" in configured.stderr:
            mac = sys.platform == "darwin"
            tell(
                NO_TOOL + ("xcode-select --install" if mac else "sudo apt install make")
            )
            return False
        done = configured
        if configured.returncode == 0:
            tell(build.COMPILING)
            done = build.run("cmake", "--build", str(folder))
        if done.returncode != 0:
            lines = [one.strip() for one in done.stderr.splitlines() if one.strip()]
            raise MissingPartError(
                "A zenoh-pico is installed, and the Woodbot can't be built over it: "
                f"{' '.join(lines[1:9])} Without it: {LIBRARY} (R0709)"
            )
        (folder / NAME).replace(made)
    return True
