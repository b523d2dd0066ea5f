"""Stale means still: a person's hand on device drivers and on the emulated board."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rems_net.client import Fabric
from rems_net.client.driving import PERIOD, RENEWAL, Driving
from rems_net.emulators.known import emulated
from tests.agents.runs import calm, until
from tests.cli.conftest import fabric, row, text
from tests.commands import Serve, Start
from tests.reliability.programs.emulated import LOOKS

#: name of the device or the board -> the words that bring it as robot/real
DRIVERS = {"create2": ("create2", "create2"), "dynabot": ("dynabot", "dynabot")}
Case = tuple[Fabric, Callable[[], bool]]


@pytest.fixture(params=[*DRIVERS, "woodbot"])
def case(
    request: pytest.FixtureRequest, start: Start, serve: Serve, tmp_path: Path
) -> Iterator[Case]:
    """A fabric with robot/real, and whether its wheels turn."""
    name, port = request.param, str(tmp_path / "port")
    serve()
    with fabric() as found:
        if name == "woodbot":
            board = start("board", "emulate", "woodbot", "--name", "real")
            until(lambda: row(found, "robot/real"), 60)
            proxy = found.robot("real")

            def turns() -> bool:
                first, last = proxy.watch("state", 2)
                return bool(first != last)

            yield found, turns
            text(board)
            return
        pytest.importorskip("pty", reason="there are no pseudo-terminals here")
        pytest.importorskip("serial", reason="pyserial is not installed")
        with emulated(name, port) as emulator:
            words = ("--name", "real", "--set", f"options.port={port}")
            driver = start("agent", "start", "robot", *DRIVERS[name], *words)
            until(lambda: row(found, "robot/real"), 30)
            yield found, lambda: LOOKS[name](emulator.device)[0]
            text(driver)


def hold(hand: Driving, turns: Callable[[], bool]) -> None:
    """Drive until the wheels turn."""

    def turning() -> bool:
        hand.keep()
        hand.send({"ahead": 50.0})
        return turns()

    until(turning)


def test_stale_means_still(case: Case) -> None:
    here, turns = case
    with Driving(here, "robot/real", by="anna") as hand:
        until(lambda: hand.seen.n > 0)
        old = hand.seen
        until(lambda: hand.seen.t > old.t + 0.65)
        for _ in range(20):
            hand.send({"ahead": 50.0}, seen=(old.n, old.t))
            hand.keep()
            assert not turns()
            time.sleep(PERIOD)
        hold(hand, turns)
        hand.rest()
        begun = calm()
        until(lambda: not turns())
        assert calm() - begun < 0.3
        hold(hand, turns)
        begun = calm()  # from now on the driver is as one that was killed
        until(lambda: not turns())
        assert calm() - begun < 1.0 + RENEWAL
