"""What the firmware has from its definition: never stale, and never too much."""

import shutil
from pathlib import Path

import pytest

from rems_net import Definition, In, Out, Schema, Settings
from rems_net.agents import registry
from rems_net.cli import main
from rems_net.defdict import angular_velocity, boolean, integer, length, number
from rems_net.errors import ExperimentError, SchemaError
from rems_net.firmware import generate
from rems_net.robots.woodbot import Woodbot
from tests.firmware.compiling import FIRMWARE
from tests.firmware.program import check_tables, compiled, run

CORE = FIRMWARE / "core"
SPEED = angular_velocity(range=(-7.3, 7.3))
WHEELS = {"wheel": {"left": SPEED, "right": SPEED}}

#: a definition with what C and its comments might trip over
MINE = """\
from rems_net import In, Out, Schema
from rems_net.defdict import angle, angular_velocity, length, number
from rems_net.robots.woodbot import Woodbot

SPEED = angular_velocity(range=(-0.1, 1e23), default=0.1, doc='*/ "up" \\\\ Größe')


class Mine(Woodbot):
    max_age = 0.25
    command = In(Schema('my "own"', {"wheel": {"left": SPEED, "right": SPEED}}))
    state = Out(
        Schema(
            "größe.state",
            {
                "arm/up/left": angle(range=("-30 deg", "30 deg")),
                "x": length(),
                "y": length(),
                "heading": angle(),
                "more": number(),
            },
        )
    )
"""


@pytest.fixture
def firmware(tmp_path: Path) -> Path:
    """A copy of the firmware."""
    return Path(shutil.copytree(FIRMWARE, tmp_path / "firmware"))


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A definition of a user's own."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE, encoding="utf-8")
    return "mine.py:Mine"


def test_the_firmware_is_not_stale() -> None:
    stale = [path.name for path in generate.stale(Woodbot, CORE)]
    assert not stale, "the definition has changed. Type: rems board generate"


def test_a_stale_firmware_is_told(
    firmware: Path, mine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["board", "generate", "--into", "firmware/core"]
    core = Path("firmware", "core")
    own = [*words, "--definition", mine]
    assert main([*words, "--check"]) == 0
    assert capsys.readouterr() == ("", "")
    assert main([*own, "--check"]) == 1
    assert capsys.readouterr().err == (
        f"rems: {core / 'woodbot_schemas.h'} and {core / 'woodbot_schemas.c'} are "
        "stale. Type the same line without --check\n"
    )
    assert main(own) == 0
    assert capsys.readouterr().out == (
        f"Wrote {core / 'woodbot_schemas.h'}\nWrote {core / 'woodbot_schemas.c'}\n"
    )
    assert main([*own, "--check"]) == 0
    assert main(own) == 0
    assert capsys.readouterr().out == f"{core} is up to date.\n"
    (firmware / "core" / "woodbot_schemas.c").unlink()
    assert main([*own, "--check"]) == 1
    assert "woodbot_schemas.c is stale" in capsys.readouterr().err


def test_the_tables_of_another_definition(
    firmware: Path, mine: str, tmp_path: Path
) -> None:
    definition = registry.load(mine, tmp_path)
    assert issubclass(definition, Definition)
    generate.write(definition, firmware / "core")
    check_tables(run(compiled(firmware, tmp_path), "table"), definition)
    for path in (firmware / "core").glob("woodbot_schemas.*"):
        text = path.read_text(encoding="utf-8")
        assert "from mine.py:Mine." in text
        assert str(tmp_path) not in text


def test_only_into_a_firmware(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match=r"not the core of a Woodbot's firmware"):
        generate.write(Woodbot, tmp_path)
    assert not list(tmp_path.glob("woodbot*"))


def like_woodbot(**own: object) -> type[Definition]:
    """A Woodbot that differs in some ports."""
    return type("Mine", (Woodbot,), own)


def sensors(**more: object) -> Out:
    own = Woodbot.sensors.schema
    return Out(Schema("s", {**own.entries, **more}))


@pytest.mark.parametrize(
    ("definition", "says"),
    [
        (
            like_woodbot(sensors=sensors(bump=boolean())),
            r"^Mine\.sensors: 'bump' is of type bool; the firmware takes float only",
        ),
        (
            like_woodbot(sensors=sensors(count=integer())),
            r"'count' is of type int; the firmware takes float only",
        ),
        (
            like_woodbot(sensors=sensors(a={"b": {"c": {"d": {"e": number()}}}})),
            r"'a/b/c/d/e' is 5 deep; the firmware takes 4",
        ),
        (
            like_woodbot(sensors=sensors(**{"x" * 32: number()})),
            r"'x{32}' has a name of 32 bytes; the firmware takes 31",
        ),
        (
            like_woodbot(sensors=sensors(**{f"n{i}": number() for i in range(11)})),
            r"Mine\.sensors: 'n10' is one field too many; the firmware takes 15",
        ),
        (
            like_woodbot(sensors=sensors(gyro_z=number())),
            r"'gyro_z' and 'gyro/z' would both be 'gyro_z' in C",
        ),
        (
            like_woodbot(sensors=sensors(double=number())),
            r"'double' cannot be called 'double' in C",
        ),
        (
            like_woodbot(sensors=sensors(größe=number())),
            r"'größe' cannot be called 'größe' in C",
        ),
        (
            like_woodbot(
                sensors=sensors(**{f"n{i}": number(doc="x" * 400) for i in range(10)})
            ),
            r"^Mine: a message of it may have \d+ bytes, and zenoh-pico drops those of "
            r"more than 4096\. Take away fields, or shorten their docs",
        ),
        (
            like_woodbot(command=In(Schema("c", {"wheel": {"left": SPEED}}))),
            r"Mine\.command has no float 'wheel/right', with which the firmware works",
        ),
        (
            like_woodbot(state=Out(Schema("s", {"x": length("mm")}))),
            r"Mine\.state: 'x' is in mm; the firmware works in m\.",
        ),
        (
            like_woodbot(
                parameters=Settings(track=length()), command=In(Schema("c", WHEELS))
            ),
            r"Mine\.parameters has no float 'wheel_radius'",
        ),
    ],
)
def test_what_the_firmware_cannot_do(definition: type[Definition], says: str) -> None:
    with pytest.raises(SchemaError, match=says):
        generate.generate(definition)
