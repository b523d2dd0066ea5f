"""`rems put`: a command from a terminal, obeyed once or for some time."""

from pathlib import Path

import pytest

from rems_net.client import Fabric
from tests.agents.runs import until
from tests.cli.complaint import complaint
from tests.commands import Run


def test_a_robot_obeys_and_then_stands(here: Fabric, rems: Run) -> None:
    """For as long as --for, in units; a field that is not named keeps its value."""
    words = ("wheel/left=1", "wheel/right=10 deg/s", "--for", "1 s")
    done = rems("put", "robot/alice/command", *words)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    proxy = here.robot("alice")
    assert proxy.state.x > 0.005
    done = rems("put", "robot/alice", "wheel/left=50 %")
    assert (done.returncode, done.stderr) == (0, "")

    def stands() -> bool:
        before = proxy.state.get()
        assert len(list(proxy.watch("state", 3))) == 3
        return bool(proxy.state.get() == before)

    until(stands)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ("robot/sim/state", "x=1"),
            "robot/sim/state can't be put: only a robot takes commands. Type, for "
            "example: rems put robot/sim/command wheel/left=3",
        ),
        (
            ("input/keys", "x=1"),
            "input/keys can't be put: only a robot takes commands. Type, for example: "
            "rems put robot/sim/command wheel/left=3",
        ),
        (
            ("robot/sim/command", "wheel/left"),
            "expected NAME=VALUE, such as wheel/left=3; got 'wheel/left'.",
        ),
        (
            ("robot/sim/command", "x=1", "--for", "2 m"),
            "--for: the value expects a number in s, but got '2 m': m (length) cannot "
            'become s (time). Type a number in s, or a text such as "1.5 s".',
        ),
    ],
)
def test_what_is_typed_wrong(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    sentence: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert complaint(capsys, "put", *words) == sentence


def test_an_unknown_field(here: Fabric, rems: Run) -> None:
    done = rems("put", "robot/alice/command", "weel/left=1")
    assert done.returncode == 2
    assert "'weel/left'" in done.stderr
    assert "Did you mean 'wheel/left'? (R0104)" in done.stderr
    done = rems("put", "robot/alice/command", "wheel/left=1 m")
    assert done.returncode == 2
    assert "rad/s" in done.stderr
