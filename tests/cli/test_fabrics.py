"""Fabrics beside each other at one router: a class's open one, and teams' own."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.agents.runs import Router, until
from tests.cli.conftest import LAB, together
from tests.commands import Done, Run, Start


@pytest.fixture
def team(rems: Run, start: Start, folder: Path) -> Iterator[Run]:
    """A laptop of team3 that has joined, beside an open fabric with robot/alice."""
    lab = folder / "lab.toml"
    lab.write_text(together(LAB, "here").replace('"1 s"', '"60 s"\npace = 1.0'))
    with Router() as router:
        done = rems("router", "use", router.endpoint, "--fabric", "team3")
        assert done.stdout.splitlines() == [
            f"Joined {router.endpoint}. From now on every rems command goes there;",
            "`rems run` is on a fabric of your own, 'team3'.",
            "No fabric is open there yet. `rems router forget` forgets it.",
        ]
        start("router", "serve")
        alice = ("robot", "woodbot", "kinematic", "--name", "alice")
        start("agent", "start", *alice, "--fabric", "rems")
        until(lambda: "robot/alice" in rems("list").stdout)
        yield rems


def agents(rems: Run, *more: str) -> list[str]:
    done = rems("list", "--json", *more)
    found = json.loads(done.stdout or "[]")
    return [f"{row.get('fabric', '')}:{row['agent']}" for row in found]


def test_a_run_has_a_fabric_of_its_own(team: Run, start: Start) -> None:
    start("run", "lab.toml")
    # The class is out of sight while there is a run of one's own...
    until(lambda: ":robot/model" in agents(team))
    assert ":robot/alice" not in agents(team)
    assert team("get", "robot/model/state/x").stdout.startswith("robot/model/state/x ")
    # ...and there for who asks for it, or for all.
    assert agents(team, "--fabric", "rems") == [":robot/alice"]
    every = agents(team, "--all")
    assert "rems:robot/alice" in every
    assert "team3:robot/model" in every
    done = team("get", "robot/alice/state/x", "--fabric", "rems")
    assert done.stdout.startswith("robot/alice/state/x ")
    stop_is_for_one_fabric_or_for_all(team)


def stop_is_for_one_fabric_or_for_all(team: Run) -> None:

    def stopped(*more: str) -> Done | None:
        done = team("stop", *more)
        return None if done.returncode else done

    done = until(stopped)
    assert "robot/model stands" in done.stdout
    assert "alice" not in done.stdout
    done = until(lambda: stopped("--all"))
    assert done.stdout.splitlines()[0] == "At rems:"
    assert "robot/alice stands" in done.stdout
    assert "At team3:" in done.stdout
    assert "robot/alice" in team("stop", "--release", "--all").stdout


def test_a_name_that_is_none(rems: Run) -> None:
    done = rems("run", "lab.toml", "--fabric", "a/b")
    assert done.returncode == 2
    assert "--fabric is 'a/b'; a name has 1 to 63 letters" in done.stderr
