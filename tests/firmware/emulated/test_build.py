"""The firmware as a shared library: compiled once, and held against its mirror."""

import os
import shutil
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from ctypes import CDLL
from pathlib import Path

import pytest

from rems_net.errors import MissingPartError
from rems_net.firmware import build, library, port
from tests.commands import ROOT, finished

needs_a_compiler = pytest.mark.skipif(
    not any(map(shutil.which, build.COMPILERS)),
    reason="There is no C compiler here: cc, gcc and clang are not found.",
)


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(tmp_path / "cache"))
    assert build.cache().is_relative_to(tmp_path)
    return build.cache()


@pytest.fixture
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile without optimizing, which takes most of the time."""
    monkeypatch.setattr(build, "FLAGS", ("-std=c11", "-O0", "-shared"))


@needs_a_compiler
@pytest.mark.usefixtures("quickly")
def test_it_is_compiled_once(empty_cache: Path) -> None:
    """Two at a time get the same; later ones find it."""
    told: list[str] = []
    with ThreadPoolExecutor() as two:
        made, other = two.map(build.library, [told.append] * 2)
    assert made == other
    assert [*empty_cache.iterdir()] == [made]
    before = made.stat()
    told.clear()
    assert build.library(told.append) == made
    assert made.stat() == before
    assert told == []
    assert library.load_from(made).woodbot_size() > 0


def test_without_a_compiler(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(MissingPartError, match=r"none of cc, gcc, clang .* Type: "):
        build.library()


@needs_a_compiler
def test_cmake_alone(
    empty_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without make and ninja there is no program, but the library, and a sentence."""
    cmake = shutil.which("cmake")
    if cmake is None:
        pytest.skip("There is no CMake here.")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "cmake").symlink_to(cmake)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    for name in ("CMAKE_GENERATOR", "CMAKE_MAKE_PROGRAM"):
        monkeypatch.delenv(name, raising=False)
    told: list[str] = []
    assert port.program(told.append) is None
    assert [sentence[: len(port.NO_TOOL)] for sentence in told] == [port.NO_TOOL]


@needs_a_compiler
def test_a_source_that_does_not_compile(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.c"
    wrong.write_text("int wrong(void) { return nothing; }\n", encoding="utf-8")
    with pytest.raises(MissingPartError, match=r"does not compile .*nothing"):
        build.compile_into(tmp_path / "wrong.so", [wrong])
    assert [*tmp_path.glob("wrong*")] == [wrong]


def test_every_source_counts(tmp_path: Path) -> None:
    one = tmp_path / "one.c"
    one.write_text("int one = 1;\n", encoding="utf-8")
    before = build.digest([one])
    one.write_text("int one = 2;\n", encoding="utf-8")
    assert build.digest([one]) != before


CLOSE, UP = "void (*close)(void *self);", "bool (*up)(void *self);"


@needs_a_compiler
@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({UP: ""}, "struct link has bytes: [0-9]+ in C, and [0-9]+ in rems_net"),
        ({UP: f"{UP} int more;"}, "struct link has bytes"),
        ({CLOSE: "!", UP: CLOSE, "!": UP}, "`close` of struct link is at byte"),
    ],
    ids=["less", "more", "another order"],
)
def test_a_mirror_that_is_out_of_date(
    tmp_path: Path, changes: dict[str, str], says: str
) -> None:
    """What changes in C alone is told of, and nothing is called."""
    copy = tmp_path / "esp32_woodbot"
    shutil.copytree(build.sources(), copy)
    header, table = copy / "core" / "link.h", copy / "shared" / "library.c"
    text = header.read_text(encoding="utf-8")
    for was, becomes in changes.items():
        assert was in text
        text = text.replace(was, becomes)
    header.write_text(text, encoding="utf-8")
    if "" in changes.values():  # what is not there has no place
        rest = table.read_text(encoding="utf-8").replace("PART(link, up),", "")
        table.write_text(rest, encoding="utf-8")
    made = tmp_path / "library.so"
    build.compile_into(made, [table, *copy.rglob("*.h")])
    places = (library.Place * 1).in_dll(CDLL(str(made)), "library_places")
    with pytest.raises(MissingPartError, match=says):
        library.check_mirrors(library.read_places(places))


@needs_a_compiler
def test_what_is_no_library_is_told(tmp_path: Path) -> None:
    made = tmp_path / "half.so"
    made.write_bytes(b"\x7fELF")
    with pytest.raises(MissingPartError, match=r"cannot be used.*Remove it"):
        library.load_from(made)


@needs_a_compiler
def test_the_wheel_brings_its_sources(tmp_path: Path) -> None:
    """Without a checkout, what `rems board emulate` compiles is in the package."""
    done = finished(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path],
        ROOT,
        seconds=600,
    )
    assert done.returncode == 0, done.stderr
    installed = tmp_path / "installed"
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        wheel.extractall(installed)
    code = (
        "from rems_net.firmware import build, library; "
        "print(build.sources()); library.load_from(build.library())"
    )
    ran = finished(
        [sys.executable, "-P", "-c", code],
        tmp_path,
        env={
            **os.environ,
            "PYTHONPATH": str(installed),
            "XDG_CACHE_HOME": str(tmp_path / "cache"),
        },
        seconds=600,
    )
    assert ran.returncode == 0, ran.stderr
    folder = Path(ran.stdout.strip())
    assert folder == installed / "rems_net" / "firmware" / "esp32_woodbot"
    for glob in (*build.SOURCES, *port.SOURCES):
        here = {p.relative_to(build.sources()) for p in build.sources().glob(glob)}
        assert here, glob
        assert {path.relative_to(folder) for path in folder.glob(glob)} == here, glob
