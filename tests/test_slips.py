"""Slips of those who write agents and experiments: one sentence each, that teaches."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, In, Input, Out, Process, Schema, Settings, Tick
from rems_net.defdict import length, number
from rems_net.errors import AgentError, RemsError, uncoded
from rems_net.robots.woodbot import Woodbot
from rems_net.toml import TOMLDecodeError, loads, meant

#: the same, for calls that a checker of types would refuse
any_number: Any = number
any_length: Any = length
any_schema: Any = Schema
any_out: Any = Out
any_in: Any = In
any_run: Any = Experiment.run


def lab(**settings: object) -> Experiment:
    return Experiment("slips", dt=0.1, duration=0.2, **settings)  # type: ignore[arg-type]


def robot(*args: object, **settings: object) -> Callable[[], object]:
    return lambda: lab().robot("sim", *args, **settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: lab(time=10), r"Experiment\(\) does not take 'time'.* Write dur.*=\."),
        (
            lambda: lab(sed=3),
            r"Experiment\(\) does not take 'sed'.* Did you mean 'seed'",
        ),
        (
            lambda: setattr(lab(), "patience", 3),
            r"an experiment has no setting 'patience', .* Write wait=\{\"back\".*",
        ),
        (lambda: setattr(lab(), "sed", 3), r".* no setting 'sed'.* Did you .*'seed'"),
        (lambda: setattr(lab(), "dt", "3 m"), r"dt: .*"),
        (lambda: setattr(lab(), "run", 3), r".* no setting 'run', .*"),
        (
            lambda: any_run(lab(), fast=True),
            r"run\(\) does not take.* Write pace=\"fast\"\.",
        ),
        (
            robot("woodbot", "kinematic", track="10 cm"),
            r"robot\(\) does not take 'track'.* definition goes into "
            r"parameters=\{'track': ...\}, one of the driver into options=\{'track'.*",
        ),
        (robot("woodbot"), r"robot\(\) is called without driver\. It takes name, .*"),
        (
            robot("woodbot", "kinematic", "input/keys"),
            r"robot\(\) takes name, definition, driver by place, and got 4 values; .*",
        ),
        (
            robot("kinematic", "woodbot"),
            r".*no definition 'kinematic'.* 'kinematic' is a driver: .* first\.",
        ),
        (
            robot("woodbot", "kinematic", options=["noise"]),
            r"robot 'sim': options is \['noise'\]; .* options=\{\"noise\": .*",
        ),
        (lambda: any_number(2), r"a unit is text, .* got 2\. .* default=2, .*"),
        (
            lambda: any_length(min=0),
            r"length\(\) does not take 'min'.* Write ra.*",
        ),
        (
            lambda: any_number("", 1),
            r"number\(\) takes unit by place, and got 2 values; .*",
        ),
        (
            lambda: any_schema("a", x=1),
            r"Schema\(\) does not take 'x'\. It takes .*",
        ),
        (
            lambda: any_out("wheels"),
            r"Out\('wheels'\) is no schema; write such .*",
        ),
        (
            lambda: any_in({"x": 1}),
            r"In\(\{...\}\) is no schema; write such .*",
        ),
        (
            lambda: any_out(Woodbot),
            r"Out\(<class .*Woodbot'>\) is no schema; write such .*",
        ),
    ],
)
def test_a_call_with_other_arguments(call: Callable[[], object], sentence: str) -> None:
    with pytest.raises(RemsError) as caught:
        call()
    assert re.match(sentence, str(caught.value)), caught.value


class Stepping(Process):
    """What each test below lets it do is in `does`."""

    s = In(Woodbot.state)
    value = Out(Schema("value", {"x": number()}))
    does: Callable[[Stepping, Tick], object]

    def step(self, tick: Tick) -> None:
        type(self).does(self, tick)


@pytest.mark.parametrize(
    ("does", "sentence"),
    [
        (
            lambda self, tick: tick * 0.1,
            r"TypeError: a tick is not a number: tick\.t .*",
        ),
        (lambda self, tick: 2 * tick, r"TypeError: a tick is not a number: tick\.t .*"),
        (
            lambda self, tick: tick == 3,
            r"TypeError: a tick is not a number: tick\.t .*",
        ),
        (lambda self, tick: tick % 2, r"TypeError: .* a tick has n \(its number\).*"),
        (lambda self, tick: tick.index, r".* 'index'; a tick has n \(its number\).*"),
        (lambda self, tick: tick.count, r".* 'count'; a tick has n \(its number\).*"),
        (lambda self, tick: tick.time, r".* a tick has n \(its number\), t \(its .*"),
        (lambda self, tick: self.state, r".* 'state'; its ports are s, value.*"),
        (lambda self, tick: self.s.x.to("mm"), r".* a field is a plain number, .*"),
        (
            lambda self, tick: self.options.gain,
            r".* has no field 'gain'\. .* states them: options = Settings\(gain=.*",
        ),
    ],
)
def test_a_slip_within_a_step(does: Callable[..., object], sentence: str) -> None:
    one = lab()
    one.robot("sim", "woodbot", "kinematic")
    one.process("p", type("P", (Stepping,), {"does": does}), s="robot/sim/state")
    with one.engine() as engine, pytest.raises(AgentError) as caught:
        engine.step()
    assert re.match(sentence, caught.value.cause), caught.value
    assert re.search(
        r"\(test_slips\.py, line \d+, in <lambda>, tick 1\)$", uncoded(caught.value)
    )


class Generating(Stepping):
    def step(self, tick: Tick) -> Any:
        yield 1


class Async(Stepping):
    async def step(self, tick: Tick) -> None:  # type: ignore[override]
        self.value = {"x": 1.0}


@pytest.mark.parametrize(("kind", "word"), [(Generating, "yield"), (Async, "async")])
def test_a_step_that_would_do_nothing(kind: type[Process], word: str) -> None:
    one = lab()
    one.robot("sim", "woodbot", "kinematic")
    one.process("p", kind, s="robot/sim/state")
    sentence = f"{kind.__name__}.step has '{word}', so nothing in it is done"
    with one.engine() as engine, pytest.raises(AgentError, match=sentence):
        engine.step()


class Voiceless(Input):
    def read(self, tick: Tick) -> dict[str, float]:
        return {"x": 1.0}


def test_an_input_without_an_out() -> None:
    one = lab()
    one.input("a", Voiceless)
    with (
        one.engine() as engine,
        pytest.raises(AgentError, match=r"no Outs, so .* add o"),
    ):
        engine.step()


class Hand(Input):
    """Takes the schema of a robot whose ranges come from its parameters."""

    value = Out(Woodbot.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"wheel/left": 7.3}


class Echo(Process):
    command = In(Woodbot.command)
    options = Settings(gain=number(default=2.0))
    value = Out(Schema("value", {"x": number()}))

    def step(self, tick: Tick) -> None:
        self.value.x = self.options.gain * self.command["wheel/left"]


def test_the_schema_of_a_port_that_depends_on_parameters() -> None:
    """Another agent takes it with the defaults of the robot's own class."""
    one = lab()
    one.input("hand", Hand)
    one.robot("sim", "woodbot", "kinematic", command="input/hand")
    one.process("echo", Echo, command="input/hand")
    with one.engine() as engine:
        engine.step()
        assert engine["echo"].value.x == 14.6
        assert engine["hand"].value.schema == engine["sim"].command.schema


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("on = True", "Write on = true."),
        ('name == "a"', 'Write name = "a".'),
        ('name = "a" // mine', 'Write name = "a".'),
        ('name: "a"', 'Write name = "a".'),
        ("name = a", 'Write name = "a".'),
        ("name = \u201ca\u201d", 'Write name = "a".'),
        ("dt = 0,1", "Write dt = 0.1."),
        ("time = ~", "To leave time open, leave the line out."),
        ("time = null", "To leave time open, leave the line out."),
        ("arm = {", "Write all of arm = { ... } on one line."),
        ("on = ?", ""),
    ],
)
def test_a_line_that_is_no_toml(line: str, sentence: str) -> None:
    text = f"[a]\nb = 1\n{line}\nc = 2\n"
    with pytest.raises(TOMLDecodeError):
        loads(text)
    assert meant(text, 3).strip() == sentence


def test_a_quote_that_is_left_open() -> None:
    assert meant('a = 1\nb = "c\n', 0).strip() == "Line 2 lacks a quote at its end."


def test_a_key_twice(tmp_path: Path) -> None:
    text = "[a]\nb = 1\n[c]\nb = 2\n\nb = 3\n"
    said = meant(text, 6, twice=True).strip()
    assert said == "b has a value in line 4 already; keep one of the two."
