"""Windows' own Python on Linux: Wine, CPython for Windows, and the system's libraries.

    python -m tests.windows.wine [FOLDER]     makes it, in five minutes and 3 GB

Everything comes from package registries, into a folder outside the checkout; nothing of
it belongs to this project. Wine is no Windows: there is no console host of Microsoft,
no Defender, no scheduler of Windows. So pages say "tried under Wine".
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import Any

ROOT = Path(__file__).parents[2]
#: the archives of Maven Central; each has a folder `org/bytedeco/<name>/<SYSTEM>`
SYSTEM = "windows-x86_64"
CPYTHON, RUNTIME = "cpython:3.12.1-1.5.10", "javacpp:1.5.10"
COMPILER = "x86_64-w64-mingw32-gcc"
#: program, and what brings it on Debian
TOOLS = {
    "wine": "wine64",
    COMPILER: "gcc-mingw-w64-x86-64-win32",
    "mvn": "maven",
}
#: Native libraries come first, since Wine's own lack functions that wheels call.
NATIVE = "ucrtbase=n,b;vcruntime140=n,b;vcruntime140_1=n,b;msvcp140=n,b"
#: Zenoh (Rust) asks this library for random bytes, and Wine 8 has none.
RANDOM = """
#include <windows.h>
#include <bcrypt.h>
__declspec(dllexport) BOOL ProcessPrng(PBYTE data, SIZE_T size)
{
    return !BCryptGenRandom(0, data, (ULONG)size, BCRYPT_USE_SYSTEM_PREFERRED_RNG);
}
"""
#: written last: a folder with it is complete; what its packages were installed for
DONE, INSTALLED = "complete.txt", "installed.toml"
#: held by the program that makes the folder
LOCK = "lock"


def missing() -> str:
    """Return why Windows' Python cannot be had here, or ""."""
    gone = [package for tool, package in TOOLS.items() if shutil.which(tool) is None]
    return f"to be installed: {' '.join(gone)}" if gone else ""


class Windows:
    """A folder with Wine's system and Windows' Python.

    folder: outside the checkout; it grows to about 2 GB.
    prefix: the system's own folder, if it is a copy.
    """

    def __init__(self, folder: Path, prefix: Path | None = None):
        self.folder = folder
        self.prefix = prefix or folder / "prefix"
        self.root = folder / "python"
        self.exe = self.root / "python.exe"

    @property
    def environment(self) -> dict[str, str]:
        """Variables for programs of this system; rems_net comes from the checkout."""
        kept = {k: v for k, v in os.environ.items() if not k.startswith(DROPPED)}
        return kept | {
            "COLUMNS": "80",
            # with its drive, since a program may start in a folder of another one
            "PYTHONPATH": f"Z:{ROOT}",
            "WINEPREFIX": str(self.prefix),
            # programs in Scripts, such as ruff, need the libraries beside python.exe
            "WINEPATH": f"Z:{self.root}",
            "WINEARCH": "win64",
            "WINEDEBUG": "-all",
            # a program that fails must end, and wait for no debugger
            "WINEDLLOVERRIDES": f"mscoree,mshtml,winedbg.exe=d;{NATIVE}",
        }

    def make(self) -> None:
        """Make what is not there yet.

        Raises CalledProcessError, OSError and AssertionError.
        """
        import fcntl  # this module is imported by Windows' Python, too

        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / LOCK).open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not (self.folder / DONE).exists():
                self._system()
                (self.folder / DONE).write_text("", encoding="utf-8")
            self._install()
            self.end()

    @contextmanager
    def copied(self, prefix: Path) -> Iterator["Windows"]:
        """Lend a copy of this system, which is ended and removed after the block.

        A copy has a server of its own. The end of a server ends all its programs, some
        with status 0, so two users of one system would disturb each other unseen.
        """
        shutil.copytree(self.prefix, prefix, symlinks=True)
        copy = Windows(self.folder, prefix)
        try:
            yield copy
        finally:
            copy.end()
            shutil.rmtree(prefix)

    def _system(self) -> None:
        for folder in (self.prefix, self.root):
            shutil.rmtree(folder, ignore_errors=True)
        self.run("wineboot", "--init")
        key = r"HKCU\Software\Wine"
        self.run("reg", "add", key, "/v", "Version", "/d", "win10", "/f")
        self._unpack(CPYTHON, self.root)
        # Wine's `platform.uname()` would ask a library for a function that it lacks.
        (self.root / "lib" / "_wmi.pyd").unlink()
        self._unpack(RUNTIME, self.root, "*.dll")
        self._visual_c()
        self._forwarder()
        self._random()
        # Nor has Wine 8 this function, which shutil calls if it is there.
        shell = self.root / "lib" / "shutil.py"
        text = shell.read_text(encoding="utf-8")
        text = text.replace('hasattr(_winapi, "CopyFile2")', "False")
        shell.write_text(text, encoding="utf-8")
        self.python("-m", "ensurepip")

    def _install(self) -> None:
        """Install what the checkout asks for, by the README's first command."""
        asked = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
        known = self.folder / INSTALLED
        if known.exists() and known.read_text(encoding="utf-8") == asked:
            return
        command = (ROOT / "README.md").read_text(encoding="utf-8").split("```sh\n")[1]
        program, *words = shlex.split(command.partition(" && ")[0])
        assert program == "python", command
        self.python(*words, "-q", "--no-warn-script-location", cwd=ROOT, seconds=900)
        self.python("-m", "pip", "uninstall", "-q", "-y", "rems-net")
        self._serial()
        known.write_text(asked, encoding="utf-8")

    def start(
        self, *words: str | Path, cwd: Path | None = None, **more: str
    ) -> subprocess.Popen[str]:
        """Start a program of this system; `more` are variables of its environment.

        Its streams are pipes: with files of Linux, Windows' Python does not start.
        """
        return subprocess.Popen(
            ["wine", *map(str, words)],
            cwd=cwd,
            env=self.environment | more,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
        )

    def run(
        self,
        *words: str | Path,
        cwd: Path | None = None,
        seconds: float = 120,
        fails: bool = False,
        **more: str,
    ) -> str:
        """Run a program of this system to its end; return all that it printed.

        Raises AssertionError if it fails, or with `fails` if it does not.
        """
        with self.start(*words, cwd=cwd, **more) as process:
            timer = Timer(seconds, process.kill)
            timer.start()
            assert process.stdout is not None
            printed = process.stdout.read()  # its input stays open, as in a terminal
            timer.cancel()
            status = process.wait()
        assert bool(status) == fails, f"{[*map(str, words)]}, {status=}: {printed}"
        return printed

    def python(self, *words: str | Path, **options: Any) -> str:
        """Run Python with these words."""
        return self.run(self.exe, *words, **options)

    def rems(self, *words: str | Path, **options: Any) -> str:
        """Run `rems` with these words."""
        return self.python("-W", "error", "-m", "rems_net", *words, **options)

    def begin(self, *words: str, cwd: Path) -> subprocess.Popen[str]:
        """Start `rems` with these words."""
        return self.start(self.exe, "-W", "error", "-m", "rems_net", *words, cwd=cwd)

    def end(self) -> None:
        """End every program of this system."""
        subprocess.run(["wineserver", "-k"], env=self.environment, check=False)

    def _unpack(self, artifact: str, to: Path, which: str = "*") -> None:
        """Fetch an archive, and unpack its folder for this system."""
        name, version = artifact.split(":")
        _run(
            ["mvn", "-q", "-B", "dependency:copy"],
            f"-Dartifact=org.bytedeco:{artifact}:jar:{SYSTEM}",
            f"-DoutputDirectory={self.folder}",
        )
        prefix = f"org/bytedeco/{name}/{SYSTEM}/"
        archive = self.folder / f"{name}-{version}-{SYSTEM}.jar"
        with zipfile.ZipFile(archive) as packed:
            for member in packed.infolist():
                path = Path(member.filename.removeprefix(prefix))
                if member.filename.startswith(prefix) and path.match(which):
                    if member.is_dir():
                        continue
                    (to / path).parent.mkdir(parents=True, exist_ok=True)
                    (to / path).write_bytes(packed.read(member))
        archive.unlink()

    def _visual_c(self) -> None:
        """Put a new runtime of Visual C++ beside python.exe: MuJoCo needs it."""
        _run(
            [sys.executable, "-m", "pip", "download", "-q", "--no-deps"],
            "--only-binary=:all:",
            "--platform=win_amd64",
            "--python-version=3.12",
            f"--dest={self.folder}",
            "msvc-runtime",
        )
        (wheel,) = self.folder.glob("msvc_runtime-*.whl")
        with zipfile.ZipFile(wheel) as packed:
            for name in packed.namelist():
                if name.endswith(".dll"):
                    (self.root / Path(name).name).write_bytes(packed.read(name))
        wheel.unlink()

    def _forwarder(self) -> None:
        """Make python3.dll, which wheels for all versions of Python look for."""
        listed = _run(["x86_64-w64-mingw32-objdump", "-p", self.root / "python312.dll"])
        exports = listed.split("[Ordinal/Name Pointer] Table")[1]
        names = re.findall(r"\[ *\d+\] (\w+)", exports)
        lines = [f"{name}=python312.{name}" for name in names]
        definition = self.folder / "python3.def"
        text = "\n".join(["LIBRARY python3.dll", "EXPORTS", *lines])
        definition.write_text(text, encoding="utf-8")
        self._link("python3.dll", definition, "-nostdlib", "-Wl,--entry=0")

    def _random(self) -> None:
        """Make bcryptprimitives.dll."""
        source = self.folder / "random.c"
        source.write_text(RANDOM, encoding="utf-8")
        self._link("bcryptprimitives.dll", source, "-lbcrypt")

    def _serial(self) -> None:
        """Have pyserial do without what Wine 8 lacks.

        Wine's ports have no USB device behind them, so no function is missed that looks
        for one. And Wine calls a read failed that ended without bytes, by its timeout.
        """
        serial = self.root / "lib" / "site-packages" / "serial"
        for name, text, instead in (
            (
                "serialwin32.py",
                "!= win32.ERROR_OPERATION_ABORTED",
                "not in (995, 1460)",
            ),
            (
                "tools/list_ports_windows.py",
                "cfgmgr32.CM_MapCrToWin32Err\n",
                "cfgmgr32.CM_Get_Parent\n",
            ),
        ):
            file = serial / name
            found = file.read_text(encoding="utf-8")
            file.write_text(found.replace(text, instead), encoding="utf-8")

    def _link(self, name: str, source: Path, *flags: str) -> None:
        _run([COMPILER, "-shared", "-o", self.root / name, source, *flags])
        source.unlink()


#: Variables of Linux that would change what Windows' programs do.
DROPPED = ("PYTHON", "VIRTUAL_ENV", "XDG_", "DISPLAY", "WAYLAND_DISPLAY", "WINE")


def _run(words: Sequence[str | Path], *more: str) -> str:
    """Run a program of Linux to its end; return its output."""
    return subprocess.run(
        [*map(str, words), *more], check=True, stdout=subprocess.PIPE, text=True
    ).stdout


def usual() -> Path:
    """Return the folder that $REMS_WINE names, or the usual one."""
    return Path(os.environ.get("REMS_WINE", Path.home() / ".cache" / "rems_net-wine"))


def main() -> None:
    """Make the folder, or end with the sentence why it cannot be made."""
    if why := missing():
        sys.exit(f"There is no Wine here with what its Python needs; {why}.")
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else usual()
    try:
        Windows(folder).make()
    except (OSError, AssertionError, subprocess.CalledProcessError) as error:
        why = " ".join(str(error).split())
        sys.exit(
            f"{folder} is not complete: {why}. If packages are still being installed, "
            "wait for their end; then run this again, and it goes on."
        )


if __name__ == "__main__":
    main()
