"""The port for the ESP32, as far as it can be held without a board.

Against the real headers of the board's SDK it is compiled only where they are: give
the compiler's words for them (`-isystem ...`, `-D...`) in a file, and its path in
WOODBOT_ESP32_FLAGS. `pio run -t compiledb` writes those of PlatformIO's own copy. With
zenoh-pico's headers among them, all of the port is compiled; without, what needs none.
"""

import os
import re
import shutil
from configparser import ConfigParser
from pathlib import Path

import pytest

from tests.commands import finished
from tests.firmware.compiling import FIRMWARE, build, compiler

ESP32 = FIRMWARE / "esp32"
#: of these compilers the first is the board's own, the second its smaller sibling's
COMPILERS = ("xtensa-esp32-elf-gcc", "xtensa-lx106-elf-gcc", "clang")
STRICT = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-Wconversion"]


def project() -> ConfigParser:
    parser = ConfigParser(inline_comment_prefixes=(";",), interpolation=None)
    parser.read(ESP32 / "platformio.ini", encoding="utf-8")
    return parser


def folders() -> list[Path]:
    """What the project lets the compiler look through."""
    flags = project()["env:woodbot"]["build_flags"].split()
    told = (f.removeprefix("-I$PROJECT_DIR") for f in flags if f.startswith("-I"))
    return [ESP32 / folder.lstrip("/") for folder in told]


def sources() -> list[Path]:
    """The C that the project compiles."""
    told = project()["env:woodbot"]["build_src_filter"]
    found: list[Path] = []
    for one in re.findall(r"\+<([^>]+)>", told):
        pattern = f"{one}**/*.c" if one.endswith("/") else one
        found += sorted(FIRMWARE.glob(pattern))
    return [path for path in found if path.suffix == ".c"]


@pytest.mark.parametrize("path", sources(), ids=lambda path: path.name)
def test_it_compiles_against_the_real_headers(path: Path, tmp_path: Path) -> None:
    flags = os.environ.get("WOODBOT_ESP32_FLAGS")
    if not flags:
        pytest.skip("The SDK's headers are not here: WOODBOT_ESP32_FLAGS is not set.")
    words = [compiler(*COMPILERS), *STRICT, f"@{flags}"]
    words += [f"-I{folder}" for folder in folders()]
    if "zenoh-pico.h" in includes(path) and not has_pico(Path(flags)):
        pytest.skip("zenoh-pico's headers are not among WOODBOT_ESP32_FLAGS.")
    build([*words, "-fsyntax-only", path], tmp_path / "nothing")


def includes(path: Path) -> str:
    """A file, and the headers of the project that it includes, as one text."""
    text = path.read_text(encoding="utf-8")
    for name in re.findall(r'^#include "(\S+)"', text, re.MULTILINE):
        near = (folder / name for folder in (path.parent, *folders()))
        found = next((one for one in near if one.exists()), None)
        text += "" if found is None else includes(found)
    return text


def has_pico(flags: Path) -> bool:
    words = flags.read_text(encoding="utf-8").split()
    return any(Path(word.removeprefix("-I"), "zenoh-pico.h").exists() for word in words)


def test_the_project_names_what_is_there() -> None:
    """Folders, sources, and the versions that were tested, not the newest."""
    assert all(folder.is_dir() for folder in folders())
    names = {path.name for path in sources()}
    assert {
        "robot.c",
        "wifi.c",
        "gyro.c",
        "cable.c",
        "member.c",
        "link_pico.c",
    } <= names
    assert {path.name for path in ESP32.rglob("*.c")} <= names
    woodbot = project()["env:woodbot"]
    assert re.fullmatch(r"espressif32@6\.\d+\.\d+", woodbot["platform"])
    libraries = woodbot["lib_deps"].split("\n")[1:]
    assert all(re.search(r"[@#]\d+\.\d+\.\d+$", one) for one in libraries)


def test_each_wrapped_call_has_its_wrapper() -> None:
    """A name that the linker wraps, and nobody wrote, would fail on the last step."""
    wrapped = re.findall(r"--wrap=(\w+)", project()["env:woodbot"]["build_flags"])
    text = (ESP32 / "network" / "sockets.c").read_text(encoding="utf-8")
    assert sorted(set(re.findall(r"__wrap_(\w+)", text))) == sorted(wrapped)
    assert sorted(set(re.findall(r"__real_(\w+)", text))) == sorted(wrapped)


# -- zenoh-pico's options ------------------------------------------------------

#: Switched off, each leaves zenoh-pico 1.9.0 without a function that it still calls.
NEEDED_TO_LINK = {"Z_FEATURE_MULTICAST_TRANSPORT", "Z_FEATURE_MATCHING"}


def options() -> dict[str, str]:
    """Return zenoh-pico's options, name and value, by PlatformIO's way to them."""
    told = project()
    extra = ESP32 / told["platformio"]["extra_configs"]
    read = told.read(extra.resolve(), encoding="utf-8")
    section, name = re.fullmatch(
        r"\$\{(\w+)\.(\w+)\}", told["env:woodbot"]["board_build.cmake_extra_args"]
    ).groups()  # type: ignore[union-attr]
    assert read == [str(FIRMWARE / "pico" / "options.ini")]
    words = told[section][name].split()
    return dict(word.removeprefix("-D").split("=") for word in words)


def test_the_board_links() -> None:
    assert {one for one in NEEDED_TO_LINK if options().get(one, "1") == "0"} == set()


@pytest.mark.skipif(shutil.which("cmake") is None, reason="There is no cmake here.")
def test_a_computer_takes_the_board_s_options(tmp_path: Path) -> None:
    """CMake names each option in which an installed zenoh-pico differs."""
    headers = tmp_path / "include" / "zenoh-pico"
    headers.mkdir(parents=True)
    lines = (f"#define {macro(name)} {value}9" for name, value in options().items())
    (headers / "config.h").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "zenohpicoConfig.cmake").write_text(
        "add_library(zenohpico::zenohpico_static INTERFACE IMPORTED)\n"
        "target_include_directories(zenohpico::zenohpico_static INTERFACE\n"
        "  ${CMAKE_CURRENT_LIST_DIR}/include)\n",
        encoding="utf-8",
    )
    words = ["-S", str(FIRMWARE / "posix"), f"-Dzenohpico_DIR={tmp_path}"]
    done = finished(["cmake", *words, "-B", str(tmp_path)], seconds=600)
    said = " ".join(done.stderr.split())
    assert done.returncode != 0
    for name, value in options().items():
        assert f"{macro(name)} is not {value}" in said
        assert f" -D{name}={value}" in said, "the line that builds it"


def macro(option: str) -> str:
    """Return the name that an option of zenoh-pico's CMake has in its config.h."""
    return f"Z_{option.removeprefix('Z_')}"
