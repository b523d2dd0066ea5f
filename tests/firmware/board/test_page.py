"""docs/firmware.md says what the code does: pins, addresses, lights; its lines run."""

import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.cli import parser
from rems_net.cli.verbs import COMMANDS
from rems_net.errors import MissingPartError, uncoded
from rems_net.firmware import build
from tests.agents.runs import until
from tests.commands import command, finished, inside as rems
from tests.firmware.compiling import CORE, FIRMWARE
from tests.firmware.emulated.scene import Serve, compiled
from tests.firmware.flashing.images import write as image
from tests.firmware.flashing.test_flash import board

DOCS = FIRMWARE.parent.parent / "docs"
PAGE = (DOCS / "firmware.md").read_text(encoding="utf-8")
DRAWING = (DOCS / "woodbot-wiring.svg").read_text(encoding="utf-8")


def rows(heading: str) -> list[list[str]]:
    """The table below a heading, without its head."""
    section = PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line[1:-1].split("|")] for line in lines[2:]]


def test_pins_are_those_of_the_board() -> None:
    board = (FIRMWARE / "esp32" / "board.h").read_text(encoding="utf-8")
    pins = {name: int(pin) for name, pin in re.findall(r"PIN_(\w+) = (\d+)", board)}
    assert len(pins) == 7
    told = {part: where for part, _, where in rows("Parts and wiring")}
    wanted = {
        "left wheel": [pins["SERVO_J7"]],
        "right wheel": [pins["SERVO_J9"]],
        "two free plugs for servos, not driven": [pins["SERVO_J6"], pins["SERVO_J8"]],
        "six lights": [pins["LIGHTS"]],
        "I2C bus, 400 kHz": [pins["SDA"], pins["SCL"]],
    }
    for part, numbers in wanted.items():
        assert told[part] == ", ".join(f"GPIO {number}" for number in numbers)
    drawn = map(int, re.findall(r">GPIO (\d+)(?: S[A-Z]+| +S[A-Z]+)?<", DRAWING))
    assert sorted(drawn) == sorted(pins.values())


def test_addresses_are_those_of_the_parts() -> None:
    sources = [*(FIRMWARE / "parts").glob("*.[ch]"), FIRMWARE / "esp32/libraries.cpp"]
    code = "".join(path.read_text(encoding="utf-8") for path in sources)
    told = {part: where[:4] for part, _, where in rows("Parts and wiring")[5:]}
    for part, address in told.items():
        assert re.search(rf"(ADDRESS = |[{{ ]){address}\b", code), part
        assert address in DRAWING


def test_the_lights_mean_what_the_core_shows() -> None:
    """The page has the table of robot/leds.c, in its order."""
    code = (CORE / "robot" / "leds.c").read_text(encoding="utf-8")
    shown = re.findall(r'SHOWS\(LIGHTS_[^"]*"([^"]*)",\s*"([^"]*)"', code)
    assert len(shown) == 9
    assert [tuple(row) for row in rows("What the lights say")] == shown


def test_verbs_are_there() -> None:
    found = re.findall(r"\brems ((?:router |board |agent |clock )?[a-z]+)", PAGE)
    assert {*found} <= COMMANDS.keys()


def test_each_line_can_be_typed() -> None:
    """Verbs and options of each line are there; what runs is run by the tests below."""
    found = re.findall(r"^ *(rems .*?)(?:  .*)?$", PAGE, re.MULTILINE)
    found += re.findall(r"`(rems [a-z]+ -[^`]*)`", PAGE)
    assert len(found) > 5
    for line in found:
        words = shlex.split(line)[1:]
        assert parser(words).parse_args(words).top == words[0], line


@pytest.mark.parametrize("system", ["win32", "darwin", "linux"])
def test_what_to_install(system: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the commands say to type is what the page says."""
    monkeypatch.setattr("sys.platform", system)
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(MissingPartError) as refused:
        build.compiler()
    assert f"`{uncoded(refused.value).partition('Type: ')[2]}`" in PAGE


def test_an_image_is_flashed(tmp_path: Path) -> None:
    """The page's line, at a stand-in of a board."""
    blocks = re.findall(r"```sh\n +(rems (?:ports|board).*)\n +```", PAGE)
    look, write = blocks
    done = rems(*look.split()[1:])
    assert done.returncode == 0 or "There is no serial port" in done.stderr
    name = image(tmp_path).name
    assert write == f"rems board flash {name}"
    with board(tmp_path) as rom:
        words = write.split()[1:]
        done = finished(command(*words, "--port", rom.terminal.where), tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert "Written, and verified." in done.stdout


@pytest.fixture
def emulated(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What the first two lines of the page start."""
    compiled()
    started = re.findall(r"```sh\n(rems (?:router serve|board emulate).*)\n```", PAGE)
    assert started[0] == "rems router serve"
    with Serve() as serve:
        monkeypatch.setenv("REMS_ROUTER", serve.endpoint)
        robot = subprocess.Popen(
            command(*started[1].split()[1:]),
            stdout=subprocess.DEVNULL,
        )
        try:
            yield
        finally:
            robot.terminate()
            robot.communicate(timeout=30)


@pytest.mark.usefixtures("emulated")
def test_without_a_robot() -> None:
    block = re.findall(r"```sh\n(rems list\n.*?)```", PAGE, re.DOTALL)[0]
    until(lambda: "robot/woodbot-7" in rems("list").stdout)
    for line in block.splitlines():
        done = rems(*line.split()[1:])
        assert (done.returncode, done.stderr) == (0, ""), line
