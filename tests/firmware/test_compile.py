"""The core, compiled as far as it can be: clean, small, and of nothing but C11."""

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.commands import finished
from tests.firmware.compiling import CORE, STRICT, build

SOURCES = sorted(CORE.rglob("*.c"))
HEADERS = sorted(CORE.rglob("*.h"))
PICOLIBC = Path("/usr/lib/xtensa-lx106-elf/picolibc.specs")

#: what the core may cost, in bytes: of code and constants, and of static data
TEXT, DATA = 50_000, 10_000
#: ... and what stands between a person and a wheel, of it
SAFETY = ("motors", "handover", "supervisor", "codec", "woodbot_schemas")
SAFETY_TEXT = 8_000

#: of C's library: nothing that allocates, waits, prints, or asks the system
ALLOWED = {
    *("cos", "sin", "sqrt", "memchr", "memcmp", "memcpy", "memmove", "memset"),
    *("strcat", "strchr", "strcmp", "strcspn", "strlen", "strncat", "strncmp"),
    *("strrchr", "strspn", "strstr"),
}
#: a compiler's own arithmetic, __muldf3, and calls, __riscv_save_0; no __atomic_load_8
HELPER = re.compile(r"__(?!atomic|sync)[a-z]+\d?|__riscv_(save|restore)_\d+")
STANDARD = {
    *("float", "limits", "math", "stdatomic", "stdbool", "stddef", "stdint", "string")
}


@dataclass(frozen=True)
class Toolchain:
    name: str
    compiler: str
    flags: tuple[str, ...] = ()
    needs: Path | None = None

    @property
    def prefix(self) -> str:
        return self.compiler.removesuffix("gcc").removesuffix("clang")


HOSTED = [Toolchain("gcc", "gcc"), Toolchain("clang", "clang")]
BARE = [
    Toolchain(
        "lx106", "xtensa-lx106-elf-gcc", (f"--specs={PICOLIBC}",), needs=PICOLIBC
    ),
    Toolchain(
        "rv32imc",
        "riscv64-unknown-elf-gcc",
        ("--specs=picolibc.specs", "-march=rv32imc", "-mabi=ilp32", "-msave-restore"),
    ),
    Toolchain("esp32", "xtensa-esp32-elf-gcc", ("-mlongcalls",)),
]
every = pytest.mark.parametrize(
    "objects", [*HOSTED, *BARE], indirect=True, ids=lambda chain: chain.name
)
bare = pytest.mark.parametrize(
    "objects", BARE, indirect=True, ids=lambda chain: chain.name
)


@dataclass(frozen=True)
class Objects:
    toolchain: Toolchain
    folder: Path

    def tool(self, tool: str, *words: str) -> list[list[str]]:
        """The words of each line that `nm` or `size` has to say of the objects."""
        files = sorted(map(str, self.folder.glob("*.o")))
        command = [f"{self.toolchain.prefix}{tool}", *words, *files]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        return [line.split() for line in done.stdout.splitlines() if line.strip()]


@pytest.fixture(scope="module")
def objects(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Objects:
    """Every file of the core, compiled at -Os with all warnings as errors."""
    chain: Toolchain = request.param
    if shutil.which(chain.compiler) is None:
        pytest.skip(f"{chain.compiler} is not on PATH.")
    if chain.needs is not None and not chain.needs.exists():
        pytest.skip(f"{chain.needs} is missing: install its C library, picolibc.")
    folder = tmp_path_factory.mktemp(chain.name)
    for source in SOURCES:
        words = [chain.compiler, *STRICT, *chain.flags, "-Os", "-c", str(source)]
        build(words, folder / f"{source.stem}.o")
    assert len(list(folder.iterdir())) == len(SOURCES), "two files have one name"
    return Objects(chain, folder)


@every
def test_every_file_compiles_without_a_warning(objects: Objects) -> None:
    assert sorted(path.stem for path in objects.folder.glob("*.o")) == sorted(
        source.stem for source in SOURCES
    )


@bare
def test_nothing_is_asked_of_the_platform(objects: Objects) -> None:
    """No heap, no printing, no waiting, no clock, and no library of atomics."""
    rows = objects.tool("nm", "-P")
    symbols = {(row[0], row[1]) for row in rows if len(row) > 1}
    defined = {name for name, kind in symbols if kind != "U"}
    asked = {name for name, kind in symbols if kind == "U"} - defined - ALLOWED
    assert not [name for name in asked if not HELPER.fullmatch(name)]


@bare
def test_the_core_is_small(
    objects: Objects, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sizes = {
        Path(row[-1]).stem: (int(row[0]), int(row[1]) + int(row[2]))
        for row in objects.tool("size")[1:]
    }
    robot = robot_size(objects.toolchain, tmp_path)
    text = sum(size for size, _ in sizes.values())
    data = sum(size for _, size in sizes.values()) + robot
    safety = sum(sizes[name][0] for name in SAFETY)
    with capsys.disabled():
        print(f"\n{objects.toolchain.name}: {text} bytes of text, {safety} of them")
        print(f"for safety; {data} of static data, struct woodbot {robot}")
    assert text <= TEXT
    assert safety <= SAFETY_TEXT
    assert data <= DATA


def robot_size(chain: Toolchain, folder: Path) -> int:
    """Bytes of a `struct woodbot`: an array of as many, and what its object takes."""
    source = folder / "robot.c"
    text = '#include "woodbot_private.h"\nchar robot[sizeof(struct woodbot)];\n'
    source.write_text(text, encoding="utf-8")
    words = [chain.compiler, "-std=c11", *chain.flags, f"-I{CORE}", "-c"]
    made = build([*words, str(source)], folder / "robot.o")
    command = [f"{chain.prefix}size", str(made)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(done.stdout.splitlines()[1].split()[2])


# -- what is written -----------------------------------------------------------


@pytest.mark.parametrize("path", [*SOURCES, *HEADERS], ids=lambda path: path.name)
def test_only_headers_of_c_are_included(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    found = set(re.findall(r"^\s*#\s*include\s*<(.*?)\.h>", text, re.MULTILINE))
    assert found <= STANDARD


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.name)
def test_each_header_stands_by_itself(header: Path, tmp_path: Path) -> None:
    found = shutil.which("gcc") or shutil.which("clang")
    if found is None:
        pytest.skip("There is no C compiler here: gcc and clang are not found.")
    source = tmp_path / "one.c"
    source.write_text(f'#include "{header}"\nextern int one;\n', encoding="utf-8")
    build([found, *STRICT, "-c", source], tmp_path / "one.o")


@pytest.mark.parametrize("flag", ["-ffast-math", "-ffinite-math-only"])
@pytest.mark.parametrize("name", ["codec.c", "safety/motors.c"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_nan_compares_as_it_should(
    compiler: str, name: str, flag: str, tmp_path: Path
) -> None:
    """Where a compiler may take NaN for impossible, nothing is compiled at all."""
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not on PATH.")
    command = [compiler, "-std=c11", "-Os", flag, "-c", str(CORE / name)]
    done = finished([*command, "-o", str(tmp_path / "one.o")], seconds=600)
    assert done.returncode != 0
    assert "NaN must not compare as in range" in done.stderr


def test_cppcheck_finds_nothing(tmp_path: Path) -> None:
    """All it knows but style: unused functions are those of the ports."""
    found = shutil.which("cppcheck")
    if found is None:
        pytest.skip("cppcheck is not on PATH.")
    words = ["--std=c11", "--enable=warning,performance,portability", "--inconclusive"]
    quiet = ["--quiet", "--error-exitcode=1", "--suppress=missingIncludeSystem"]
    done = finished([found, *words, *quiet, f"-I{CORE}", str(CORE)], seconds=600)
    assert done.returncode == 0, done.stderr
