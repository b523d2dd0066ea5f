"""`driver = "remote"`: a robot of another run, driven from here under a lease."""

import math
import os
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest

from rems_net import In, Schema, client
from rems_net.agents.robot import combine
from rems_net.agents.runtime import runtime
from rems_net.defdict import angular_velocity, length
from rems_net.drivers.remote import Remote
from rems_net.errors import AgentError, ConversionError, FabricError, SchemaError
from rems_net.robots.woodbot import Woodbot
from rems_net.router.message import pack, pack_stamp
from tests.agents.runs import Router, until
from tests.commands import command
from tests.drivers import alone
from tests.drivers.hardware.parts import Cart
from tests.interrupts import APART, interrupt

THERE = """\
[experiment]
name = "there"
dt = "20 ms"
duration = "600 s"
pace = 1.0
record = false

[[robot]]
name = "bot"
definition = "woodbot"
driver = "kinematic"

[[input]]
name = "keys"
type = "csv"
options.file = "keys.csv"
host = "here"

[[robot]]
name = "led"
host = "here"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
600,0,0
"""
AHEAD = {"wheel/left": 3.0, "wheel/right": 3.0}
SIDES, SPEED = ("left", "right"), angular_velocity("deg/s", range=(-360, 360))
BACK = {"wheel/left": -3.0, "wheel/right": -3.0}


@pytest.fixture(scope="module")
def there(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A run with two robots, one of which nobody commands; where its router is."""
    folder = tmp_path_factory.mktemp("there")
    (folder / "there.toml").write_text(THERE)
    (folder / "keys.csv").write_text(KEYS)
    with Router() as router:
        words = command("run", "there.toml", "--fabric", "there", "--out", "out")
        env = os.environ | {"REMS_ROUTER": router.endpoint}
        run = subprocess.Popen(
            words, cwd=folder, env=env, stdout=subprocess.DEVNULL, text=True, **APART
        )
        try:
            with client.join("there", at=router.endpoint) as found:
                until(lambda: found.session.who("there/robot/bot/@alive"), 30)
                found.agents()
            yield router.endpoint
        finally:
            interrupt(run)
            run.wait(20)


def remote(there: str, name: str = "bot", definition: Any = Woodbot) -> Any:
    options = {"key": f"there/robot/{name}", "at": there}
    return combine(definition, Remote)("mine", options=options)


def refused(robot: Any) -> str:
    """What is told as it can't be opened."""
    with pytest.raises((AgentError, ConversionError)) as told, alone.opened(robot):
        pass
    return str(told.value)


def test_driven_by_one_and_stopped_by_either(there: str) -> None:
    with client.join("there", at=there) as home:
        bot = home.robot("bot")
        with alone.opened(remote(there)) as robot:
            alone.keep(robot, AHEAD, lambda: robot.state.x > 0.05)
            # Nobody else commands it, however often.
            far = robot.state.x

            def keeps_on() -> bool:
                bot.command.update(BACK)
                return bool(robot.state.x > far + 0.1)

            alone.keep(robot, AHEAD, keeps_on)
            assert robot.state.x - far < 1.0
            assert "from robot/mine of " in "".join(home.why("robot/bot/command"))
            assert "robot/bot is leased to robot/mine of " in refused(remote(there))
            # STOP there...
            home.stop()
            alone.keep_for(robot, AHEAD, 0.2)
            still = bot.state.get()
            alone.keep_for(robot, AHEAD, 0.3)
            assert bot.state.get() == still
            home.release()
            alone.keep(robot, AHEAD, lambda: robot.state.x > still.x + 0.05)
            # ...and here.
            runtime(robot).stopped = True
            alone.keep(robot, AHEAD, lambda: robot.standing.is_sure)
            still = bot.state.get()
            alone.keep_for(robot, AHEAD, 0.3)
            assert bot.state.get() == still
            runtime(robot).stopped = False
            alone.keep(robot, AHEAD, lambda: robot.state.x > still.x + 0.05)
            robot.reset()
            alone.keep(robot, {}, lambda: robot.reading_age < 0.1)
            assert abs(robot.state.x) < 0.05
            alone.keep(robot, AHEAD, lambda: robot.figures()["safe"] == "")
        # Given back, it stands at once, and obeys whoever comes.
        still = bot.state.get()
        until(lambda: bot.command.update(BACK) or bot.state.x < still.x - 0.02)


def test_a_lease_that_is_not_asked_for_again_ends(there: str) -> None:
    with client.join("there", at=there) as home:
        bot, session = home.robot("bot"), home.session
        put = session.putting("there/robot/bot/command", block=False)
        drive = bot.command.get()
        drive.update(AHEAD)

        def drives(badge: int, more: float = 0.02) -> bool:
            before = float(bot.state.x)
            n = home.agents()[0]["tick"]
            put(drive.encode(), attachment=pack_stamp(n, 0.0, badge))
            return float(bot.state.x) > before

        assert session.ask("there/robot/bot/@lease", pack((7, "a test")), first=True)
        with pytest.raises(FabricError, match="leased to a test"):
            session.ask("there/robot/bot/@lease", pack((8, "another")), first=True)
        until(lambda: drives(7))
        until(lambda: "from a test" not in "".join(home.why("robot/bot/command")))
        assert session.ask("there/robot/bot/@lease", pack((8, "another")), first=True)
        assert not drives(7)
        assert session.ask("there/robot/bot/@lease", pack((8, "")), first=True)


class Degrees(Woodbot):
    """A Woodbot whose commands are in other units."""

    command = In(Schema("degrees.command", {"wheel": dict.fromkeys(SIDES, SPEED)}))


class Wrong(Woodbot):
    """Its command is in metres."""

    command = In(Schema("wrong.command", {"wheel": dict.fromkeys(SIDES, length())}))


def test_units_are_converted(there: str) -> None:
    turned = dict.fromkeys(("wheel/left", "wheel/right"), 180.0)
    with client.join("there", at=there) as home:
        bot = home.robot("bot")
        with alone.opened(remote(there, definition=Degrees)) as robot:
            obeyed: list[float] = []

            def obeys() -> bool:
                obeyed.append(float(bot.command["wheel/left"]))
                return obeyed[-1] > 0

            alone.keep(robot, turned, obeys)
            assert obeyed[-1] == pytest.approx(math.pi)


def test_mistakes_are_a_sentence_each(there: str) -> None:
    assert "input/keys commands robot/led there; no other program can" in refused(
        remote(there, "led")
    )
    absent = refused(remote(there, "alice"))
    assert "there is no robot/alice on 'there' at tcp/" in absent
    assert "Robots there: bot, led. To bring it, type: rems agent start robot" in absent
    assert "Did you mean 'bot'?" in refused(remote(there, "boot"))
    assert "wheel/left" in refused(remote(there, definition=Cart))
    wrong = refused(remote(there, definition=Wrong))
    assert "there/robot/bot" in wrong
    assert "wheel/left" in wrong
    with pytest.raises(SchemaError, match="expected a fabric and its robot"):
        combine(Woodbot, Remote)("mine", options={"key": "there/input/keys"}).prepare()
    gone = combine(Woodbot, Remote)("mine", options={"at": "tcp/127.0.0.1:9"})
    assert "127.0.0.1:9" in refused(gone)


@pytest.mark.parametrize(
    "payload", [b"", b"\xc1", pack(3), pack((0, "")), pack((5, 6))]
)
def test_a_lease_asked_for_by_nonsense_is_refused(there: str, payload: bytes) -> None:
    with client.join("there", at=there) as home, pytest.raises(FabricError):
        home.session.ask("there/robot/bot/@lease", payload, first=True)


def test_a_run_that_is_as_fast_as_it_can_be_has_no_lease(there: str) -> None:
    with client.join("there", at=there) as home:
        home.clock("pace", "fast")
        try:
            until(lambda: home.agents()[0]["tick"])
            assert "give that run a pace: --pace 1" in refused(remote(there))
        finally:
            home.clock("pace", 1.0)
