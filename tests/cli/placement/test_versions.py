"""Laptops that differ in their rems_net, or in a definition: both are told."""

from rems_net.router.message import machine as name_of_this
from tests.cli.conftest import KEYS
from tests.cli.placement.conftest import ON_B, Pair, ended, one_line, wait_for
from tests.interrupts import interrupt

OTHER = (
    "import rems_net; rems_net.__version__ = '0.0.9'\n"
    "from rems_net.cli import main\nraise SystemExit(main({!r}))\n"
)


def test_an_open_fabric_of_another_version(pair: Pair) -> None:
    anna, ben = pair
    served = anna.start("router", "serve")
    words = ["agent", "start", "robot", "woodbot", "kinematic", "--name", "ben"]
    assert served.stdout is not None
    assert served.stdout.readline().startswith("Open fabric")
    status, _, error = ended(ben.python("-c", OTHER.format(words)))
    assert status == 2
    assert 'Type: pip install "rems-net==0.1.0"' in error
    interrupt(served)
    _, out, error = ended(served)
    assert f"{name_of_this()} has rems_net 0.0.9, and this laptop" in out + error


def test_another_version_is_told_on_both_sides(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    words = ["agent", "bring", "--as", "b", "--yes"]
    run = anna.start("run", "lab.toml")
    wait_for(run, "rems agent bring")
    status, out, error = ended(ben.python("-c", OTHER.format(words)))
    assert (status, out) == (2, "")
    assert (
        f"this laptop has rems_net 0.0.9, and the clock's, {name_of_this()}, has "
        '0.1.0. Type: pip install "rems-net==0.1.0" (R0617)\n'
    ) in error
    assert ended(ben.bring("--as", "b"))[0] == 0
    status, out, _ = ended(run)
    assert status == 0
    assert (
        f"[clock] {name_of_this()} has rems_net 0.0.9, and this laptop 0.1.0: it is "
        "not let in until both have one version"
    ) in one_line(out)
