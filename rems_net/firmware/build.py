"""Build: the Woodbot's core as a shared library, compiled here and kept for next time.

Its name has a digest of all that it is made of: who changes a source gets another
library, and never an old one.
"""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from rems_net.errors import MissingPartError

#: the sources that it is made of
SOURCES = ("core/**/*.[ch]", "posix/body.[ch]", "shared/*.[ch]")
COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c11", "-O2", "-shared")
#: said before what takes a while
COMPILING = "compiles the firmware, once for these sources"
#: seconds that the compiler may take
PATIENCE = 120.0
ENDINGS = {"win32": ".dll", "darwin": ".dylib"}


def sources() -> Path:
    """The folder of the firmware: in a checkout, else inside the installed package."""
    here = Path(__file__).parent
    for folder in (here.parent.parent / "firmware", here):
        if (folder / "esp32_woodbot" / "core" / "woodbot.h").is_file():
            return folder / "esp32_woodbot"
    raise MissingPartError(
        "The sources of the firmware are missing: expected the folder "
        f"{here / 'esp32_woodbot'}. Install rems-net once more."
    )


def library(tell: Callable[[str], None] = lambda _: None) -> Path:
    """The shared library; compiled, where it is not there yet, and `tell` is told.

    Raises MissingPartError where there is no compiler, or it fails.
    """
    folder = sources()
    files = sorted(path for glob in SOURCES for path in folder.glob(glob))
    made = cache() / f"woodbot-{digest(files)}{ENDINGS.get(sys.platform, '.so')}"
    if not made.exists():
        tell(COMPILING)
        compile_into(made, files)
    return made


def cache() -> Path:
    """Where this user's compiled libraries are."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "rems_net" / "firmware"


def digest(files: list[Path]) -> str:
    """What tells one library from all others: sources, flags, and the machine."""
    made = hashlib.sha256(repr((FLAGS, sys.platform, platform.machine())).encode())
    for path in files:
        content = path.read_bytes()
        made.update(f"{path.parent.name}/{path.name} {len(content)}\n".encode())
        made.update(content)
    return made.hexdigest()[:16]


def compiler() -> str:
    """The C compiler. Raises MissingPartError with what to install."""
    found = next(filter(None, map(shutil.which, COMPILERS)), None)
    if found is None:
        todo = {
            "win32": "winget install -e --id BrechtSanders.WinLibs.POSIX.UCRT",
            "darwin": "xcode-select --install",
        }.get(sys.platform, "sudo apt install gcc")
        raise MissingPartError(
            "The firmware runs here as a library that a C compiler makes, and none of "
            f"{', '.join(COMPILERS)} is found. Type: {todo}"
        )
    return found


def compile_into(made: Path, files: list[Path]) -> None:
    """Compile under another name, and move it: nobody ever loads half a library."""
    position = () if sys.platform == "win32" else ("-fPIC", "-fvisibility=default")
    try:
        made.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".", dir=made.parent) as folder:
            new = Path(folder) / made.name
            rooms = sorted({f"-I{path.parent}" for path in files})
            flags = [*FLAGS, *position, *rooms, "-o", str(new)]
            units = [str(path) for path in files if path.suffix == ".c"]
            command = [compiler(), *flags, *units]
            done = run(*command, "-lm")
            if done.returncode != 0 or not new.exists():
                raise MissingPartError(_failed(command[0], done.stderr))
            with suppress(PermissionError):  # Windows: somebody else made it meanwhile
                new.replace(made)
    except subprocess.TimeoutExpired:
        raise MissingPartError(
            f"The C compiler {command[0]} took longer than {PATIENCE:g} s for the "
            "firmware, and was ended. Try it once more."
        ) from None
    except OSError as error:
        raise MissingPartError(
            f"The firmware's library cannot be kept in {made.parent}: "
            f"{error.strerror or error}."
        ) from None


def run(*words: str) -> subprocess.CompletedProcess[str]:
    """Run a compiler to its end. Raises TimeoutExpired after PATIENCE."""
    return subprocess.run(
        words,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=PATIENCE,
        check=False,
    )


def _failed(name: str, told: str) -> str:
    lines = [line for line in told.splitlines() if "error" in line] or ["no reason"]
    return f"The C compiler {name} does not compile the firmware: {lines[0].strip()}"
