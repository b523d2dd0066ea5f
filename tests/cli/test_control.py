"""`rems clock`, `call` and `join` against a running fabric."""

import json
from pathlib import Path

from tests.agents.runs import until
from tests.cli.conftest import FREE
from tests.commands import Agents, Run, Start


def test_the_clock_obeys(
    folder: Path, rems: Run, program: Run, start: Start, agents: Agents
) -> None:
    (folder / "free.toml").write_text(FREE)
    running = start("run", "free.toml")
    agents(3)
    assert rems("clock", "pause").stdout.startswith("tick ")
    before = json.loads(rems("get", "clock/tick", "--json").stdout)["rems/clock/tick"]
    for count in (5, 1):
        done = rems("clock", "step", *([str(count)] if count > 1 else []))
        before["n"] += count
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == f"tick {before['n']}\n"
    after = json.loads(rems("get", "clock/tick", "--json").stdout)
    assert after["rems/clock/tick"]["n"] == before["n"]
    assert rems("clock", "pace", "2").stdout == "pace 2\n"
    assert rems("clock", "resume").returncode == 0
    assert (rems("call", "robot/bot", "reset").returncode) == 0
    wrong = program("call", "robot/bot", "rest")
    assert (wrong.returncode, wrong.stderr) == (
        1,
        "rems: robot/bot: there is no verb 'rest'; there is reset. "
        "Did you mean 'reset'? (R0513)\n",
    )
    assert program("clock", "end").returncode == 0
    assert running.wait(20) == 0


def test_rates_are_those_of_now(
    folder: Path, rems: Run, start: Start, agents: Agents
) -> None:
    """Seen before: an average from the first tick on, in which a pause stayed."""
    (folder / "free.toml").write_text(FREE.replace('"20 ms"', '"100 ms"'))
    start("run", "free.toml")
    agents(3)

    def rate() -> float:
        row, _ = json.loads(rems("list", "--json").stdout)
        return float(row["rate"])

    until(lambda: 8.0 < rate() < 12.0)
    rems("clock", "pause")
    until(lambda: rate() == 0.0)
    assert " 0.0 Hz " in rems("list").stdout
    rems("clock", "pace", "2")
    rems("clock", "resume")
    until(lambda: 16.0 < rate() < 24.0)


def test_mistakes(rems: Run) -> None:
    for args, sentence in (
        (
            ("clock", "pace"),
            "rems: the following arguments are required: PACE. Type: rems clock pace "
            "--help (R0902)\n",
        ),
        (
            ("clock", "step", "x"),
            "rems: argument TICKS: invalid int value: 'x'. Type: rems clock step "
            "--help (R0902)\n",
        ),
    ):
        done = rems(*args)
        assert (done.returncode, done.stderr) == (2, sentence)
