"""What check_robot says of good robots, and of wrong ones of every kind."""

import gc
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net import Definition, Driver
from rems_net.agents import registry
from rems_net.defdict import DefDict
from rems_net.errors import ConformanceError, ExperimentError
from rems_net.testing import Finding, Outcome, Subject, check_robot, examine
from tests.drivers.hardware.cart import Device
from tests.drivers.hardware.parts import Cart as BareCart, SerialCart
from tests.testing import robots
from tests.testing.robots import WRONG, Cart, Good


@pytest.fixture(autouse=True, scope="module")
def _quickly() -> None:
    """Looking for leaks collects garbage: not that of all tests before, each time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _ended() -> Iterator[None]:
    """What wrong robots leave running ends with the test."""
    robots.over.clear()
    yield
    robots.over.set()


def looked(driver: type[Driver], *only: str) -> dict[str, Outcome]:
    """All outcomes by name, or those of some checks; all are in this process."""
    found = examine(Subject(Cart, driver), moves=True, alone=not only, only=only)
    return {one.name: one for one in found}


def marked(cls: type) -> int:
    """The line of the class with `# wrong` in it; 0 for none."""
    lines, first = inspect.getsourcelines(cls)
    found = [n for n, line in enumerate(lines, first) if "# wrong" in line]
    return found[0] if found else 0


@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("driver", WRONG, ids=lambda cls: cls.__name__)
def test_wrong(driver: type[Driver]) -> None:
    """The right check finds it, says what came, and names the line."""
    check, _, part = (driver.__doc__ or "").partition(": ")
    found = looked(driver, check)[check].findings
    assert found, "nothing was found"
    said = f"{found[0].expected} {found[0].came}"
    assert part in said
    if line := marked(driver):
        assert re.search(rf"robots\.py, line {line}\b", found[0].where + said), found


def test_good() -> None:
    found = looked(Good)
    assert [one for one in found.values() if one.findings or one.notes] == []
    assert not any(one.skipped for one in found.values())


def test_in_processes() -> None:
    """What a process's own number does to the recording."""
    (wrong,) = looked(robots.Local, "processes")["processes"].findings
    assert re.search(r"line 2: state/x \[m\] is \S+ in one, and ", wrong.came)
    assert f"line {marked(robots.Local)}" in wrong.where


def test_what_no_process_can_find() -> None:
    class Hidden(Good):
        pass

    (wrong,) = looked(Hidden, "processes")["processes"].findings
    assert "defined inside a function" in wrong.came


def test_one_mistake_is_told_once() -> None:
    found = looked(robots.Breaks)
    assert [name for name, one in found.items() if one.findings] == ["drives"]
    assert found["stops"].skipped == "the same as in 'drives'"


def test_nothing_else_is_looked_at_where_it_does_not_open() -> None:
    found = looked(robots.NoDevice)
    assert [name for name, one in found.items() if one.findings] == ["opens"]
    assert "what is wrong with 'opens'" in found["closes"].skipped


def test_raises_with_the_whole_report() -> None:
    with pytest.raises(ConformanceError) as told:
        check_robot(Cart, robots.Hasty, alone=True)
    said = str(told.value)
    assert said.startswith("Cart done by Hasty\n  built ")
    assert said.splitlines()[-1].endswith(" checks found something wrong. (R0316)")
    assert max(map(len, said.splitlines())) <= 79
    assert check_robot(Cart, Good, alone=True).ok


def test_a_definition_states_what_it_tolerates() -> None:
    slips = {"slip": 0.08}
    with pytest.raises(ConformanceError, match=r"tolerance = \{'(x|heading)': 0.1\}"):
        check_robot(Cart, Good, options=slips, only=["agrees"])

    class Loose(Cart):
        tolerance = 0.1

    found = check_robot(Loose, Good, options=slips, only=["agrees"])["agrees"]
    assert re.fullmatch(r"within 8\.\d\d% of its model \(10% allowed\)", found.remark)

    class ByField(Cart):
        tolerance = {"x": 0.1, "y": 0.1, "heading": 0.1}  # noqa: RUF012

    assert check_robot(ByField, Good, options=slips, only=["agrees"]).ok


def test_a_definition_that_has_no_rates_is_named_by_what_it_has() -> None:
    class Stepped(Definition):
        command, state = Cart.command, Cart.state

        def advance(self, state: DefDict, command: DefDict, dt: float) -> Any:
            return {"x": state["x"] + command["speed"] * dt}

    class Twice(Driver):
        def drive(self, command: DefDict, dt: float) -> None:
            self.state["x"] += 2 * command["speed"] * dt

        def sense(self) -> None:
            pass

    class Bare(Definition):
        command, state = Cart.command, Cart.state

    found = examine(Subject(Bare, Twice), only=["agrees"])
    none = next(one for one in found if one.name == "agrees")
    assert "Bare has no derivative(state, command)" in none.skipped
    assert none.skipped.endswith("the rates by which the state changes.")

    found = examine(Subject(Stepped, Twice), only=["agrees"])
    (wrong,) = next(one for one in found if one.name == "agrees").findings
    assert (
        "x within 5.0% of the value by Stepped.advance (test_check_" in wrong.expected
    )


def test_what_is_heavy_says_how_slow_slow_motion_is() -> None:
    """It is always 0.12 s late: that is 8 % of the way in 2 s, and 4 % in 4 s."""

    class Heavy(Good):
        going = 0.0

        def rewind(self) -> None:
            super().rewind()
            self.going = 0.0

        def drive(self, command: DefDict, dt: float) -> None:
            self.going += (command["speed"] - self.going) * dt / 0.17
            command["speed"] = self.going
            super().drive(command, dt)

    class Slow(Cart):
        eases = 1.0

    with pytest.raises(ConformanceError, match=r"(7|8)\.\d%"):
        check_robot(Cart, Heavy, only=["agrees"])
    late = check_robot(Slow, Heavy, only=["agrees"])["agrees"]
    assert re.match(r"within (3|4)\.\d", late.remark), late.remark


def test_a_script_that_is_read_for_its_classes_checks_nothing() -> None:
    with registry.running_by(registry.end_script):
        assert check_robot(Cart, robots.Still).outcomes == []


@pytest.mark.parametrize(
    ("definition", "driver", "said"),
    [
        ("wodbot", "kinematic", "Did you mean 'woodbot'"),
        ("woodbot", "kinetic", "Did you mean 'kinematic'"),
        ("no_such.py:Cart", "kinematic", "no file"),
        (Good, "kinematic", "Good is no definition"),
        (Cart, Cart, "Cart is no driver"),
    ],
)
def test_what_is_no_robot(definition: type, driver: type, said: str) -> None:
    with pytest.raises(ExperimentError, match=said):
        check_robot(definition, driver)


def test_one_class_that_is_both() -> None:
    class Both(Cart, Good):
        pass

    with pytest.raises(ExperimentError, match="takes the two apart"):
        check_robot(Both, Good)


# -- in wall time --------------------------------------------------------------------


def test_hardware_moves_only_when_it_may() -> None:
    with pytest.raises(ExperimentError, match="put it on a stand"):
        check_robot(Cart, robots.Wheels)


def test_no_thread_that_stops_it() -> None:
    (wrong,) = looked(robots.Unwatched, "stops")["stops"].findings
    assert "no device thread" in wrong.came


def test_a_device_that_coasts() -> None:
    """The safe command is put, and its motor goes on."""
    (wrong,) = looked(robots.Coasts, "stops")["stops"].findings
    assert wrong.came.startswith("x goes on by ")


def test_a_device_at_a_line(tmp_path: Path) -> None:
    """A firmware in a process of its own, at a pseudo-terminal."""
    with Device(tmp_path) as device:
        found = check_robot(
            BareCart,
            SerialCart,
            options={"port": str(device.link)},
            moves=True,
            alone=True,
        )
        assert "s of wall time at most" in found["stops"].remark
        heard = device.heard()
    assert heard[-1]["heard"] == [0.0, 0.0]
    assert max(abs(note["heard"][0]) for note in heard) == 0.1


def test_a_finding_as_text() -> None:
    found = Finding("robots " * 12, "none", "cart.py, line 3", "a = 1\n    b = 2")
    assert list(found.lines()) == [
        "    expected  robots robots robots robots robots robots robots robots robots",
        "              robots robots robots",
        "    came      none",
        "    where     cart.py, line 3",
        "    type      a = 1",
        "                  b = 2",
    ]
