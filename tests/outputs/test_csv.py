"""CsvOutput: exact, whole rows that can be played again."""

from __future__ import annotations

import csv
import errno
import os
from pathlib import Path
from typing import Any

import pytest

import rems_net
from rems_net import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.tick import Tick
from rems_net.agents.world import OBJECT
from rems_net.defdict import (
    DefDict,
    Schema,
    angle,
    array,
    boolean,
    choice,
    integer,
    length,
    number,
    text,
)
from rems_net.errors import AgentError
from rems_net.inputs.csv import CsvInput
from rems_net.outputs.csv import CsvOutput
from rems_net.recordings.manifest import read_manifest

STATE = Schema(
    "state", {"x": length(), "arm": {"joint": angle("deg")}, "gain": number()}
)
ODD = Schema(
    "command",
    {
        "count": integer(),
        "on": boolean(),
        "mode": choice("slow", "fast"),
        "say": text(),
        "arm": array((2,), "rad"),
    },
)


def output(folder: Path, **ports: DefDict) -> CsvOutput:
    """An output that hears these ports of one robot, `bot`."""
    made = CsvOutput("log", out=folder)
    made.prepare()
    made.open()
    hear(made, **ports)
    return made


def hear(agent: CsvOutput, **ports: DefDict) -> None:
    values: dict[str, Any] = {f"robot/bot/{port}": v for port, v in ports.items()}
    agent.__dict__ |= {"robots": values, "worlds": {}}


def read(path: Path) -> list[list[str]]:
    return list(csv.reader(path.read_text(encoding="utf-8").splitlines()))


def test_one_row_per_tick(tmp_path: Path) -> None:
    state = STATE({"x": 0.1 + 0.2, "gain": 1e-300})
    log = output(tmp_path, state=state, sensors=STATE(), command=STATE())
    log.write(Tick(1, 0.1, 0.1))
    header, row = read(tmp_path / "bot.csv")
    assert header == [
        "time [s]",
        "command/x [m]",
        "command/arm/joint [deg]",
        "command/gain",
        "state/x [m]",
        "state/arm/joint [deg]",
        "state/gain",
        "sensors/x [m]",
        "sensors/arm/joint [deg]",
        "sensors/gain",
    ]
    assert row[0] == "0.1"
    assert [float(cell) for cell in row[4:7]] == [0.1 + 0.2, 0.0, 1e-300]
    log.close()
    assert log.made() == [tmp_path / "bot.csv"]


def test_every_row_is_there_at_once(tmp_path: Path) -> None:
    """Nothing waits in a buffer that a kill would lose."""
    log = output(tmp_path, state=STATE())
    for n in range(1, 4):
        log.write(Tick(n, n / 10, 0.1))
        assert len(read(tmp_path / "bot.csv")) == n + 1
    log.close()


def test_the_same_values_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        log = output(tmp_path / name, state=STATE({"x": 1 / 3}))
        log.write(Tick(1, 0.1, 0.1))
        log.close()
    first, second = ((tmp_path / name / "bot.csv").read_bytes() for name in "ab")
    assert first == second


def test_what_it_writes_can_be_played(tmp_path: Path) -> None:
    """Whatever a command is made of."""
    told = {
        "count": 2**53 - 1,
        "on": True,
        "mode": "fast",
        "say": 'a "word",\nand more',
        "arm": [0.1, -1 / 3],
    }
    log = output(tmp_path, command=ODD(told), state=STATE())
    log.write(Tick(1, 0.1, 0.1))
    log.close()
    player = CsvInput("again", options={"file": "bot.csv"}, folder=tmp_path)
    player.prepare()
    player.step(Tick(1, 0.1, 0.1))
    again = player.value.schema.converter(ODD)(player.value)
    assert again == ODD(told)


SAID = ['=HYPERLINK("http://x")', "+1", "-1", "@a", "\tx", "'=x", "'", "plain", ""]


def test_no_text_is_a_formula_of_a_spreadsheet(tmp_path: Path) -> None:
    """A text that another user's robot sends is read back as it was."""
    log = output(tmp_path, command=ODD())
    for i, said in enumerate(SAID, 1):
        hear(log, command=ODD({"say": said, "mode": "fast"}))
        log.write(Tick(i, i / 10, 0.1))
    log.close()
    header, *rows = read(tmp_path / "bot.csv")
    column = header.index("command/say [text]")
    assert not [row[column] for row in rows if row[column][:1] in list("=+-@\t\r")]
    told = CsvInput("keys", options={"file": str(tmp_path / "bot.csv")})
    told.prepare()
    told.open()
    assert [told.read(Tick(i, i / 10, 0.1))["say"] for i in range(1, 10)] == SAID


def test_robots_come_and_go(tmp_path: Path) -> None:
    log = output(tmp_path, state=STATE())
    log.write(Tick(1, 0.1, 0.1))
    log.__dict__["robots"] = {"robot/new/state": STATE()}
    log.write(Tick(2, 0.2, 0.1))
    log.close()
    assert [row[0] for row in read(tmp_path / "bot.csv")] == ["time [s]", "0.1"]
    assert [row[0] for row in read(tmp_path / "new.csv")] == ["time [s]", "0.2"]
    assert [path.name for path in log.made()] == ["bot.csv", "new.csv"]


def test_what_lies_about_in_a_world(tmp_path: Path) -> None:
    """A file of its own, next to that of a robot of the world's name."""
    log = output(tmp_path, state=STATE())
    things = {f"world/bot/{n}": OBJECT({"pose/x": 1 / 3}) for n in ("ball", "crate")}
    log.__dict__["worlds"] = things
    log.write(Tick(1, 0.1, 0.1))
    log.close()
    assert [path.name for path in log.made()] == ["bot.csv", "world.bot.csv"]
    header, row = read(tmp_path / "world.bot.csv")
    assert header[:2] == ["time [s]", "ball/pose/x [m]"]
    assert header[7] == "crate/pose/x [m]"
    assert [float(cell) for cell in row] == [0.1, *[1 / 3, 0, 0, 0, 0, 0] * 2]


class Small:
    """A file on a disk with room for so many bytes."""

    def __init__(self, room: int):
        self.held, self.room = b"", room

    def write(self, line: bytes) -> int:
        if self.room == len(self.held):
            raise OSError(errno.ENOSPC, "No space left on device")
        taken = line[: self.room - len(self.held)]
        self.held += taken
        return len(taken)

    def tell(self) -> int:
        return len(self.held)

    def truncate(self, size: int) -> None:
        self.held = self.held[:size]

    def close(self) -> None:
        pass


def test_a_full_disk_leaves_whole_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = output(tmp_path, state=STATE())
    log.write(Tick(1, 0.1, 0.1))
    (file,) = log._files.values()
    file.close()
    disk = Small(40)
    monkeypatch.setattr(file, "_file", disk)
    log.write(Tick(2, 0.2, 0.1))
    log.write(Tick(3, 0.3, 0.1))
    with pytest.raises(AgentError) as full:
        log.write(Tick(4, 0.4, 0.1))
    said = f"output/log: cannot write {tmp_path / 'bot.csv'}: No space left on device"
    assert str(full.value) == (
        f"{said}; make room there, or name another folder: rems run --out (R0801)"
    )
    assert disk.held.endswith(b"\n")
    assert {line.count(b",") for line in disk.held.splitlines()} == {3}


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "bot.csv").mkdir()
    log = output(tmp_path, state=STATE())
    why = "Permission denied" if os.name == "nt" else "Is a directory"
    with pytest.raises(AgentError, match=rf"log: cannot write .*bot\.csv: {why}"):
        log.write(Tick(1, 0.1, 0.1))


def test_an_input_and_a_robot_of_one_name(tmp_path: Path) -> None:
    """Each has a file of its own, also from two outputs."""
    (tmp_path / "keys.csv").write_text(
        "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1,3,2\n"
    )
    lab = Experiment("names", dt=0.1, duration=0.3, folder=tmp_path, record=False)
    lab.input("sim", "csv", options={"file": "keys.csv"})
    lab.robot("sim", "woodbot", "kinematic", command="input/sim")
    lab.output("log", "csv")
    lab.output("more", "csv", robots="input/*/*")
    found = lab.run(tmp_path / "two", direct=True, show=Show())
    names = ["input.sim.csv", "sim.csv"]
    assert sorted(path.name for path in found.files) == names
    del lab.plans["output/more"]
    lab.plans["output/log"].sources["robots"] = "*/*/*"
    both = lab.run(tmp_path / "one", direct=True, show=Show())
    for name in names:
        one = (tmp_path / "one" / name).read_bytes()
        assert one == (tmp_path / "two" / name).read_bytes()
    assert [*both] == ["sim"]
    assert both["input/sim"]["value/wheel/left"][0].value == 3
    begun = read_manifest(tmp_path / "one")
    assert begun is not None
    assert sorted(begun.files) == names


@pytest.mark.parametrize("direct", [True, False])
def test_a_robot_is_at_its_initial_place_before_its_first_step(
    tmp_path: Path, direct: bool
) -> None:
    """In CSV files and in MCAP, from which the same CSV file is exported."""
    lab = Experiment("late", dt=0.1, duration=1.0)
    lab.robot("a", "woodbot", "kinematic", host=HERE)
    lab.robot("b", "woodbot", "kinematic", every=3, initial={"x": "1 m"}, host=HERE)
    lab.output("log", "csv")
    result = lab.run(tmp_path / "run", show=Show(), direct=direct)
    assert result["b"]["state/x"].tolist() == [1.0] * 10
    written = (tmp_path / "run" / "b.csv").read_bytes()
    (tmp_path / "run" / "b.csv").unlink()
    again = rems_net.read(tmp_path / "run")
    assert again["b"]["state/x"].tolist() == [1.0] * 10
    (made,) = again.export("b", to="csv", folder=tmp_path / "export")
    assert made.read_bytes() == written
