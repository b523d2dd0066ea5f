"""`rems list`, `get`, `clock`, `call`, `watch` beside strangers who answer for all."""

import json
from functools import partial
from pathlib import Path

from rems_net.client import join
from tests.agents.runs import calm, until
from tests.cli.conftest import FREE
from tests.client.programs import programs
from tests.commands import Agents, Run, Start

#: seconds of a whole process; it was 10 to 60
SOON = 3.0
WAYS = ("silent", "garbage", "maps", "refuse")


def test_every_question_is_answered(
    folder: Path,
    start: Start,
    rems: Run,
    agents: Agents,
) -> None:
    """By one that is right, though four others answer too, each in a way of its own."""
    (folder / "free.toml").write_text(FREE.replace("pace", "record = false\npace"))
    running = start("run", "free.toml")
    agents(3)

    def ask(*args: str) -> str:
        begun = calm()
        done = rems(*args)
        assert calm() - begun < SOON
        assert done.returncode == 0, done.stderr
        for line in done.stderr.splitlines():
            assert line.startswith("rems: ")
            assert " passed over; " in line
        return done.stdout

    with programs() as begin:
        with join() as fabric:
            session = fabric.session
            for way in WAYS:
                begin("stranger.py", session.link.endpoint, way)
                until(partial(session.ask, f"rems/stranger/{way}", first=True))
        assert [row["agent"] for row in json.loads(ask("list", "--json"))] == [
            "robot/bot"
        ]
        assert ask("get", "robot/bot/state").startswith("robot/bot/state  (tick ")
        assert list(json.loads(ask("get", "robot/*/state", "--json"))) == [
            "rems/robot/bot/state"
        ]
        assert ask("clock", "pause").startswith("tick ")
        assert ask("clock", "resume").startswith("tick ")
        assert ask("call", "robot/bot", "reset") == ""
        assert ask("watch", "robot/bot/state", "--count", "1").endswith(" rad\n")
        wrong = rems("get", "robot/bot/stat")
        assert wrong.returncode == 2
        assert wrong.stderr.splitlines()[-1] == (
            "rems: Nothing lives at 'robot/bot/stat'. Did you mean 'robot/bot/state'?"
            " (R0602)"
        )
        assert rems("clock", "end").returncode == 0  # once: it is not there any more
        assert running.wait(20) == 0
