"""Settings that change while an agent runs: checked, recorded, and done again."""

from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.errors import FieldValueError, RemsError, SchemaError
from tests.agents.runs import in_one_host
from tests.cli.recorded import SAME
from tests.commands import inside

PARTS = Path(__file__).parent


def lab() -> Experiment:
    made = Experiment("tuned", dt=0.1, duration=3.0, folder=PARTS)
    made.input("swing", "tuned.py:Swing")
    for name in ("a", "b"):
        made.robot(name, "tuned.py:Cart", "kinematic", command="input/swing")
    return made


def test_a_live_setting_changes_at_the_next_tick(tmp_path: Path) -> None:
    with lab().engine() as engine:
        engine.step(3)
        assert engine["a"].state.x == engine["b"].state.x > 0
        engine["swing"].adjust(gain=0.0, rest="20 cm/s")
        engine["robot/b"].adjust(factor=0.5)
        a, b = engine["a"].state.x, engine["b"].state.x
        engine.step(1)
        assert engine["swing"].value.speed == 0.2
        assert engine["a"].state.x - a == pytest.approx(0.02)
        assert engine["b"].state.x - b == pytest.approx(0.01)  # it alone


def test_what_does_not_fit_changes_nothing() -> None:
    with lab().engine() as engine:
        with pytest.raises(SchemaError, match=r"'title' of input/swing .* gain, rest"):
            engine["swing"].adjust(gain=1.0, title="x")
        with pytest.raises((FieldValueError, RemsError), match="gain"):
            engine["swing"].adjust(rest=0.5, gain=7.0)
        assert dict(engine["swing"].options) == {
            "gain": 0.5,
            "rest": 0.1,
            "title": "swing",
        }


def test_a_rerun_repeats_what_was_changed(tmp_path: Path) -> None:
    with lab().engine(tmp_path / "run") as engine:
        engine.step(10)
        engine["swing"].adjust(gain=1.5)
        engine["b"].adjust(factor=0.25)
        engine.run()
    done = inside("rerun", str(tmp_path / "run"), folder=PARTS)
    assert SAME in done.stdout, done
    again = rebuild(tmp_path / "run" / "run.mcap", PARTS)
    in_one_host(again.lab)
    assert compare(again, fabric=True).differ == 0
