"""The value of an In is another agent's: its reader can keep it, and not set it."""

import re
from typing import Any

import pytest

from rems_net import Experiment, In, Input, Out, Process, Schema, Tick
from rems_net.defdict import DefDict, array, length, many
from rems_net.errors import AgentError, SchemaError
from rems_net.robots.woodbot import Woodbot

MARK = Schema("mark", {"at": length()})
SEEN = Schema(
    "seen",
    {
        "x": length(),
        "wheel": {"left": length(), "right": length()},
        "lidar": array(2, "m"),
        "marks": many(MARK, max_len=3),
    },
)


class Eye(Input):
    value = Out(SEEN)

    def read(self, tick: Tick) -> dict[str, Any]:
        return {"x": tick.t, "wheel/left": 2.0, "lidar": [1, 2], "marks": [{"at": 3}]}


class Reader(Process):
    s = In(SEEN)
    all = In()
    sum = Out(Schema("sum", {"x": length()}))
    code = ""

    def step(self, tick: Tick) -> None:
        if tick.n == 2:
            exec(compile(self.code, __file__, "exec"), {"self": self})


class Keeper(Process):
    s = In(SEEN)
    all = In()
    kept: tuple[DefDict, dict[str, DefDict]] | None = None

    def step(self, tick: Tick) -> None:
        self.kept = self.kept or (self.s, self.__dict__["all"])


def read_by(reader: type[Process]) -> Experiment:
    lab = Experiment("ins", dt="0.1 s")
    lab.input("eye", Eye)
    lab.process("reader", reader, s="input/eye", all="*/*/value")
    return lab


@pytest.mark.parametrize(
    ("code", "path"),
    [
        ("self.s.x = 0", "x"),
        ("self.s['x'] = 0.0", "x"),
        ("self.s.wheel.left = 1.0", "wheel/left"),
        ("self.s.wheel = {'left': 1}", "wheel"),
        ("self.s['wheel']['left'] = 1", "wheel/left"),
        ("self.s['**/left'] = 1", "**/left"),
        ("self.s['wheel/*'].update({'wheel/left': 1})", "wheel/left"),
        ("self.s.update(x=1)", "x"),
        ("self.s.update({'wheel': {'left': 1}})", "wheel"),
        ("self.s = {'x': 1}", "x"),
        ("self.s |= {'x': 1}", "x"),
        ("self.s.clip(x=1)", "x"),
        ("self.s.marks[0].at = 1", "at"),
    ],
)
def test_setting_an_in_is_refused(code: str, path: str) -> None:
    """With what to do instead, the line and the tick; nothing is changed."""
    sentence = (
        f"{path!r} of 's' is set, and s is an In: its value is another agent's, and "
        "can only be read; write to an Out, or copy it: mine = self.s.copy() "
        "(test_ins.py, line 1, in <module>, tick 2)"
    )
    with read_by(type("Reader", (Reader,), {"code": code})).engine() as engine:
        with pytest.raises(AgentError, match=re.escape(sentence)):
            engine.step(3)
        seen = engine["process/reader"].s
        assert (seen.x, seen.wheel.left, seen.marks[0].at) == (0.2, 2.0, 3.0)


def test_an_array_is_set_as_a_whole() -> None:
    sentence = (
        "ValueError: assignment destination is read-only; the array of a field is set "
        "as a whole: copy it, change the copy, and set the field of an Out "
        "(test_ins.py, line 1, in <module>, tick 2)"
    )
    lab = read_by(type("Reader", (Reader,), {"code": "self.s.lidar[0] = 1"}))
    with lab.engine() as engine, pytest.raises(AgentError, match=re.escape(sentence)):
        engine.step(3)


def test_what_a_glob_selects_is_refused_too() -> None:
    code = "self.all['input/eye/value'].x = 1"
    lab = read_by(type("Reader", (Reader,), {"code": code}))
    with lab.engine() as engine, pytest.raises(AgentError, match="'x' of 'all' is set"):
        engine.step(3)


def test_before_a_value_comes_the_default_is_refused_too() -> None:
    with read_by(Keeper).engine() as engine:
        with pytest.raises(SchemaError, match="s is an In"):
            engine["process/reader"].s.x = 1.0
        engine.step(1)


def test_a_kept_value_does_not_change() -> None:
    """Each tick brings another one. A copy is the reader's own."""
    with read_by(Keeper).engine() as engine:
        engine.step(3)
        reader = engine["process/reader"]
        value, selected = reader.kept
        assert value.x == selected["input/eye/value"].x == 0.1
        assert reader.s.x == reader.__dict__["all"]["input/eye/value"].x != 0.1
        mine = reader.s.copy()
        mine.x, mine.wheel.left, mine.marks[0].at = 9.0, 8.0, 7.0
        assert (reader.s.x, reader.s.marks[0].at) == (engine.t, 3.0)
        assert mine.encode() == SEEN(mine).encode() != reader.s.encode()
        assert SEEN.converter(SEEN)(reader.s) == reader.s


def test_the_command_of_a_robot_is_put_and_kept() -> None:
    """It is not set in an engine; a safe command replaces it, and changes none."""
    lab = Experiment("command", dt="0.1 s")
    lab.robot("sim", Woodbot, "kinematic")
    with lab.engine() as engine:
        sim = engine["robot/sim"]
        engine.put("robot/sim/command", {"wheel": {"left": 3.0}})
        with pytest.raises(SchemaError, match=r"engine.put\(key, \{...\}\) commands a"):
            sim.command.wheel.left = 4.0
        told = sim.command
        engine.step(20)
        assert told.wheel.left == 3.0
        assert sim.command == sim.command.schema()
        with pytest.raises(SchemaError, match="command is an In"):
            sim.command = {"wheel": {"left": 4.0}}
        sim.reset()
        with pytest.raises(SchemaError, match="command is an In"):
            sim.command = {"wheel": {"left": 4.0}}
