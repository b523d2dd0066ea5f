"""Inputs that people move, and rules of connections, in the engine."""

from pathlib import Path

import pytest

from rems_net import Experiment, Input, Out, Schema, load, rule
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.tick import Tick
from rems_net.defdict import boolean, percent
from rems_net.errors import ExperimentError


class Arrows(Input):
    """Holds one arrow down."""

    value = Out(Schema("arrows", {"up": boolean(), "down": boolean()}))

    def read(self, tick: Tick) -> dict[str, bool]:
        return {"up": True}


side = percent(range=(-100, 100))


@rule(
    needs={"up": boolean(), "down": boolean()},
    gives={"wheel/left": side, "wheel/right": side},
)
def half(arrows: dict[str, bool]) -> dict[str, float]:
    """50 % while an arrow is held down."""
    speed = 50.0 * (arrows["up"] - arrows["down"])
    return {"wheel/left": speed, "wheel/right": speed}


def plain(arrows: dict[str, bool]) -> dict[str, float]:
    return {}


def test_a_stick_drives_and_stands_when_nobody_is_there() -> None:
    lab = Experiment("lab", duration="10 s")
    lab.input("stick", "hand")
    lab.robot("wood", "woodbot", "kinematic", command="input/stick")
    lab.robot("base", "youbot", "kinematic", command="input/stick")
    with lab.engine() as engine:
        engine.put("input/stick/command", {"ahead": 50})
        engine.step(5)
        wood, base = engine["robot/wood"], engine["robot/base"]
        assert wood.command["wheel/left"] == pytest.approx(3.65)
        assert base.command["linear/x"] == pytest.approx(0.7405 / 2)
        engine.step(2)  # 0.5 s old: the hand is gone
        gone = wood.state["x"]
        engine.step(5)
        assert wood.command == wood.command.schema()
        assert wood.state["x"] == gone
        engine.put("input/stick/command", {"turn": 100})
        engine.stop()
        engine.step(2)
        assert wood.command == wood.command.schema()


def test_keys_drive_and_two_inputs_drive_one_robot() -> None:
    """The youBot's base by keys; its arm by an input of its own."""

    lab = Experiment("lab", duration="10 s")
    lab.input("keys", "keyboard")
    lab.input("arm", Arrows)
    lab.robot(
        "you", "youbot", "kinematic", command=["input/keys", "input/arm"], rules=[bend]
    )
    with lab.engine() as engine:
        engine.put("input/keys/command", {"left": True})
        engine.step(3)
        you = engine["robot/you"]
        assert you.command["angular/z"] == pytest.approx(0.6 * 1.91839, rel=1e-4)
        assert you.command["arm/joint/1"] == pytest.approx(0.5, rel=1e-4)


@rule(
    needs={"up": boolean()},
    gives={"arm/joint/1": percent(range=(0, 100)), "arm/speed": percent()},
)
def bend(arrows: dict[str, bool]) -> dict[str, float]:
    """Turn the first joint."""
    middle, share = 50.0, 100 * 0.5 / (2 * 2.94961)
    return {"arm/joint/1": middle + share, "arm/speed": 100.0}


def test_a_rule_in_python_and_in_a_file(tmp_path: Path) -> None:
    lab = Experiment("lab", duration="1 s")
    lab.input("arrows", Arrows)
    lab.robot("wood", "woodbot", "kinematic", command="input/arrows", rules=[half])
    with lab.engine() as engine:
        engine.step(1)
        assert engine["robot/wood"].command["wheel/left"] == pytest.approx(3.65)
    here = Path(__file__).as_posix()
    (tmp_path / "lab.toml").write_text(
        f'[[input]]\nname = "arrows"\ntype = "{here}:Arrows"\n'
        '[[robot]]\nname = "wood"\ndefinition = "woodbot"\ndriver = "kinematic"\n'
        f'command = "input/arrows"\nrules = ["{here}:half"]\n'
        '[experiment]\nduration = "1 s"\n',
        encoding="utf-8",
    )
    with load(tmp_path / "lab.toml").engine() as engine:
        engine.step(1)
        assert engine["robot/wood"].command["wheel/left"] == pytest.approx(3.65)


def test_the_same_in_processes(tmp_path: Path) -> None:
    """The rule travels to the host by its name, and into the recording's plan."""
    lab = Experiment("lab", duration="0.5 s", record=False)
    lab.input("arrows", Arrows, host=HERE)
    lab.robot("wood", "woodbot", "kinematic", command="input/arrows", rules=[half])
    lab.output("log", "csv", host=HERE)
    result = lab.run(tmp_path / "run")
    assert float(result["wood"]["state/x"].value[-1]) == pytest.approx(0.0365)


@pytest.mark.parametrize(
    ("rules", "sentence"),
    [
        ([plain], "rules has plain, a plain function: write @rule"),
        ([3], "rules has 3; expected a function with @rule above it, or its name"),
        ("half", "rules has 'half'; expected a function with @rule above it"),
        (
            [f"{Path(__file__).as_posix()}:none"],
            "rules has .*; expected a function with @rule",
        ),
    ],
)
def test_what_is_no_rule(rules: object, sentence: str) -> None:
    lab = Experiment("lab")
    with pytest.raises(ExperimentError, match=f"^robot 'a': {sentence}") as error:
        lab.robot("a", "woodbot", "kinematic", rules=rules)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)


def test_a_person_is_too_slow_for_a_fast_run() -> None:
    lab = Experiment("lab", duration="1 s")
    lab.input("stick", "hand")
    lab.robot("wood", "woodbot", "kinematic", command="input/stick")
    with pytest.raises(ExperimentError, match=r"input/stick is moved by a person, and"):
        lab.run()
