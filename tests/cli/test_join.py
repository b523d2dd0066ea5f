"""`rems router use` and `rems router forget`: typed once, used from then on."""

import json
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.router.finding import remembered
from tests.agents.runs import Router
from tests.cli.conftest import LAB, together
from tests.commands import Run, reason_of


def test_joined_used_and_left(
    folder: Path, rems: Run, program: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "lab.toml").write_text(together(LAB))
    with Router() as router:
        done = program("router", "use", router.endpoint)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == (
            f"Joined {router.endpoint}. From now on every rems command goes there;\n"
            f"`rems run` is on a fabric of your own, {remembered.usual_fabric()!r}.\n"
            "No fabric is open there yet. `rems router forget` forgets it.\n"
        )
        assert remembered.router() == router.endpoint
        done = rems("run", "lab.toml")  # its clock is there
        assert done.returncode == 0, done.stderr
        assert "no experiment runs there" in rems("list").stderr
    # what REMS_ROUTER says wins
    monkeypatch.setenv("REMS_ROUTER", "tcp/127.0.0.1:9")
    assert "No router answers at tcp/127.0.0.1:9." in rems("list").stderr
    monkeypatch.delenv("REMS_ROUTER")
    lost = rems("list")
    assert (lost.returncode, lost.stdout) == (2, "")
    assert lost.stderr.startswith(f"rems: No router answers at {router.endpoint}. ")
    assert lost.stderr.endswith(
        "If that was the class's, and you are not there, type: rems router forget"
        " (R0601)\n"
    )
    done = program("router", "forget")
    assert done.stdout == f"Left {router.endpoint}.\n"
    assert rems("router", "forget").stdout == "There was nothing to leave.\n"
    assert "No fabric 'rems' is running on this machine." in rems("list").stderr


def test_another_machine_is_named_first(
    rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    remembered.remember("tcp/no-such-machine.invalid:7447")
    said = rems("list").stderr.splitlines()
    assert (
        said[0]
        == "rems: at tcp/no-such-machine.invalid:7447 (see `rems router forget`)"
    )
    monkeypatch.setenv("REMS_ROUTER", "tcp/nowhere.invalid:7447")
    said = rems("list").stderr.splitlines()
    assert said[0] == "rems: at tcp/nowhere.invalid:7447 (set by REMS_ROUTER)"
    assert rems("router", "forget").stderr == ""  # it goes nowhere


def test_nothing_is_joined_that_is_not_there(rems: Run) -> None:
    done = rems("router", "use", "tcp/127.0.0.1:9")
    assert done.returncode == 2
    assert done.stderr.startswith("rems: No router answers at tcp/127.0.0.1:9. ")
    assert remembered.router() == ""


def test_what_bring_is_for(rems: Run) -> None:
    done = rems("router", "use", "lab.toml")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: lab.toml is an experiment; to bring its agents to an open fabric, "
        "type: rems agent start lab.toml (R0604)\n"
    )


def test_what_cannot_be_remembered_leaves_nothing() -> None:
    """Least of all the password, in a file of another name."""
    here = remembered.path()
    here.mkdir(parents=True)
    with pytest.raises(FabricError, match="Cannot remember"):
        remembered.remember("tcp/10.0.0.1:7447", user="anna", password="seven herons")
    assert list(here.parent.iterdir()) == [here]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"router": 3}', "\x00" * 9000])
def test_a_file_that_remembers_nothing(text: str) -> None:
    remembered.path().parent.mkdir(parents=True)
    remembered.path().write_text(text)
    assert remembered.router() == ""


def test_it_cannot_be_kept(rems: Run, tmp_path: Path) -> None:
    (tmp_path / "config").write_text("in the way")
    with Router() as router:
        done = rems("router", "use", router.endpoint)
    assert done.returncode == 2
    where = tmp_path / "config" / "rems_net" / "router.json"
    reason = reason_of(lambda: where.parent.mkdir(parents=True, exist_ok=True))
    assert done.stderr == (
        f"rems: Cannot remember {router.endpoint} in {where}: {reason}. Set "
        f"REMS_ROUTER to {router.endpoint} instead."
        " (R0612)\n"
    )


def test_what_is_kept(tmp_path: Path) -> None:
    remembered.remember("tcp/lab-pc:7447")
    kept = json.loads(remembered.path().read_text())
    usual = remembered.usual_fabric()
    assert kept == {"router": "tcp/lab-pc:7447", "fabric": usual}
    assert remembered.forget() == "tcp/lab-pc:7447"
    assert remembered.forget() == ""
