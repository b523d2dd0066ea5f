"""Build: compile the Woodbot's core into a shared library, and cache it.

The file name has a digest of all sources and flags. After a change of a source, a new
library is compiled; an old one is never used.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rems_net.errors import MissingPartError

#: Sources of the library.
SOURCES = ("core/**/*.[ch]", "posix/body.[ch]", "shared/*.[ch]")
COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c11", "-O2", "-shared")
#: Printed before compiling, which takes a while.
COMPILING = "compiles the firmware, once for these sources"
#: s that the compiler may take.
COMPILE_TIMEOUT = 120.0
ENDINGS = {"win32": ".dll", "darwin": ".dylib"}
#: By system: variable with a user's folder for caches; that folder in their home.
CACHES = {"win32": ("LOCALAPPDATA", "AppData/Local"), "darwin": ("", "Library/Caches")}


def sources() -> Path:
    """Return the firmware's folder: in a checkout, else in the installed package."""
    here = Path(__file__).parent
    for folder in (here.parent.parent / "firmware", here):
        if (folder / "esp32_woodbot" / "core" / "woodbot.h").is_file():
            return folder / "esp32_woodbot"
    raise MissingPartError(
        "The sources of the firmware are missing: expected the folder "
        f"{here / 'esp32_woodbot'}. Install rems-net once more. (R0709)"
    )


def library(tell: Callable[[str], None] = lambda _: None) -> Path:
    """Return the shared library; compile it if it is not in the cache.

    tell: called before compiling, with a sentence. Raises MissingPartError if there is
    no compiler, or if it fails.
    """
    folder = sources()
    files = sorted(path for glob in SOURCES for path in folder.glob(glob))
    made = cache() / f"woodbot-{digest(files)}{ENDINGS.get(sys.platform, '.so')}"
    if not made.exists():
        tell(COMPILING)
        compile_into(made, files)
    return made


def cache() -> Path:
    """Return the folder of this user's compiled libraries."""
    variable, usual = CACHES.get(sys.platform, ("XDG_CACHE_HOME", ".cache"))
    base = Path(os.environ.get(variable) or Path.home() / usual)
    return base / "rems_net" / "firmware"


def digest(files: list[Path]) -> str:
    """Return a digest that identifies a library: sources, flags, and computer."""
    made = hashlib.sha256(repr((FLAGS, sys.platform, platform.machine())).encode())
    for path in files:
        content = path.read_bytes()
        made.update(f"{path.parent.name}/{path.name} {len(content)}\n".encode())
        made.update(content)
    return made.hexdigest()[:16]


def compiler() -> str:
    """Return the C compiler. Raises MissingPartError with what to install."""
    found = next(filter(None, map(shutil.which, COMPILERS)), None)
    if found is None:
        todo = {
            "win32": "winget install -e --id BrechtSanders.WinLibs.POSIX.UCRT",
            "darwin": "xcode-select --install",
        }.get(sys.platform, "sudo apt install gcc")
        raise MissingPartError(
            "The firmware runs here as a library that a C compiler makes, and none of "
            f"{', '.join(COMPILERS)} is found. Type: {todo} (R0709)"
        )
    return found


def compile_into(made: Path, files: list[Path]) -> None:
    """Compile the library. Raises MissingPartError if there is no compiler."""
    position = () if sys.platform == "win32" else ("-fPIC", "-fvisibility=default")
    with beside(made) as folder:
        new, cc = folder / made.name, compiler()
        rooms = sorted({f"-I{path.parent}" for path in files})
        flags = [*FLAGS, *position, *rooms, "-o", str(new)]
        units = [str(path) for path in files if path.suffix == ".c"]
        done = run(cc, *flags, *units, "-lm")
        if done.returncode != 0 or not new.exists():
            lines = [line for line in done.stderr.splitlines() if "error" in line]
            first = [*lines, "no reason"][0].strip()
            raise MissingPartError(
                f"The C compiler {cc} does not compile the firmware: {first} (R0709)"
            )
        with suppress(PermissionError):  # Windows: another process made it
            new.replace(made)


@contextmanager
def beside(made: Path, otherwise: str = ".") -> Iterator[Path]:
    """Yield a new folder, to build a file in it and then move the file to `made`.

    So no program finds half a file.  otherwise: how to do without it. Raises
    MissingPartError if building takes too long, or the disk takes nothing.
    """
    try:
        made.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".", dir=made.parent) as folder:
            yield Path(folder)
    except subprocess.TimeoutExpired as error:
        raise MissingPartError(
            f"{error.cmd[0]} took longer than {COMPILE_TIMEOUT:g} s for the firmware, "
            f"and was ended. Try it once more{otherwise} (R0709)"
        ) from None
    except OSError as error:
        raise MissingPartError(
            f"The compiled firmware cannot be kept in {made.parent}: "
            f"{error.strerror or error}. (R0709)"
        ) from None


def run(*words: str) -> subprocess.CompletedProcess[str]:
    """Run a compiler to its end. Raises TimeoutExpired after COMPILE_TIMEOUT."""
    return subprocess.run(
        words,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=COMPILE_TIMEOUT,
        check=False,
    )
