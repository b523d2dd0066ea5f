"""A run elsewhere commands a Woodbot under a lease: the firmware's side of it."""

from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.client import Fabric
from rems_net.drivers.remote import Remote
from rems_net.errors import AgentError, FabricError
from rems_net.robots.woodbot import Woodbot
from rems_net.router.message import pack
from tests.agents.runs import until
from tests.drivers import alone
from tests.firmware.protocol.world import LONG, World, drive, figures, row

AHEAD = {"wheel/left": 3.0, "wheel/right": 3.0}


def there(here: World, **settings: str) -> Fabric:
    """A robot on an open fabric."""
    here.clock()
    here.robot(**settings)
    home = here.fabric()
    until(lambda: row(home), LONG)
    return home


def remote(here: World) -> Any:
    options = {"key": "rems/robot/w7", "at": here.endpoint}
    return combine(Woodbot, Remote)("mine", options=options)


def refused(here: World) -> str:
    with pytest.raises(AgentError) as told, alone.opened(remote(here)):
        pass
    return str(told.value)


def test_driven_by_one_and_stopped_by_its_own_fabric(here: World) -> None:
    home = there(here)
    drive(home)  # what was said before counts no more
    with alone.opened(remote(here)) as robot:
        alone.keep(robot, AHEAD, lambda: robot.state.x > 0.02, LONG)
        far = robot.state.x

        def keeps_on() -> bool:
            home.robot("w7").command.update({"wheel/left": -3.0, "wheel/right": -3.0})
            return bool(robot.state.x > far + 0.05)

        alone.keep(robot, AHEAD, keeps_on, LONG)
        why = "".join(home.why("robot/w7/command"))
        assert "from robot/mine of " in why
        assert "another run holds its lease, and nobody else commands it." in why
        assert "it is leased to robot/mine of " in refused(here)
        until(lambda: all(one.stands for one in home.stop()), LONG)
        alone.keep_for(robot, AHEAD, 0.2)  # its state is that of the newest tick
        still = home.robot("w7").state.get()
        alone.keep_for(robot, AHEAD, 0.3)
        assert home.robot("w7").state.get() == still
        home.release()
        alone.keep(robot, AHEAD, lambda: robot.state.x > still.x + 0.02, LONG)
    # At its motors' next step, and not because what it was told is too old.
    assert until(lambda: figures(home)["safe"]) == "told nothing yet"
    drive(home)


def test_a_lease_ends_by_itself(here: World) -> None:
    home = there(here)
    key = home.session.key("robot", "w7", "@lease")
    assert home.session.ask(key, pack((7, "a test")), first=True)
    with pytest.raises(FabricError, match="it is leased to a test; wait until"):
        home.session.ask(key, pack((8, "another")), first=True)
    for bad in (b"", pack((0, "a")), pack((7, "a" * 101)), pack((7, "\n"))):
        with pytest.raises(FabricError, match=r"expected a claim: \[badge, holder\]"):
            home.session.ask(key, bad, first=True)
    assert not home.session.ask("rems/robot/*/@lease", pack((7, "a test")), 0.3)
    until(lambda: "from a test" not in "".join(home.why("robot/w7/command")), LONG)
    drive(home)


def test_a_robot_that_is_taken_back(here: World) -> None:
    """It stands; the run that had it is told by whom, and another one may have it."""
    home = there(here)
    assert home.take("robot/w7") == ""
    with pytest.raises(FabricError, match=r"expected \[1, the taker's name\]"):
        home.session.ask("rems/robot/w7/@lease/take", pack((1, "")), first=True)
    with alone.opened(remote(here)) as robot:
        alone.keep(robot, AHEAD, lambda: robot.state.x > 0.02, LONG)
        assert home.take("robot/w7").startswith("robot/mine of ")
        until(lambda: figures(home)["safe"] == "told nothing yet")
        with alone.opened(remote(here)) as second:
            alone.keep(second, AHEAD, lambda: second.state.x > 0.02, LONG)
            with pytest.raises(AgentError, match="was taken back by somebody on "):
                alone.keep(robot, AHEAD, lambda: False, LONG)
            far = second.state.x
            alone.keep(second, AHEAD, lambda: second.state.x > far + 0.02, LONG)
    drive(home)


def test_one_that_has_a_source_is_not_leased(here: World) -> None:
    there(here, source="input/keys")
    assert "input/keys commands it there, and nobody else does" in refused(here)
