"""A router that is restarted, frozen, or moved to another address."""

import re
from pathlib import Path

import pytest

from tests.network.lab import SOON, Lab
from tests.network.test_runs import alone, ends
from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import missing

pytestmark = [
    pytest.mark.slow,
    pytest.mark.root,
    pytest.mark.timeout(400),
    pytest.mark.skipif(bool(missing()), reason=missing()),
]


@pytest.mark.parametrize("fault", ["restarted", "frozen"])
def test_a_closed_run_goes_on(tmp_path: Path, fault: str) -> None:
    with Lab(tmp_path) as lab:
        hub, router = lab.build().router("hub")
        expected = alone(lab, router, duration=6, pace=1)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        if fault == "restarted":
            hub.kill()
            lab.wait(2)
            lab.router("hub", router)
        else:
            hub.freeze()
            lab.wait(8)
            hub.thaw()
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.digest("here") == expected


def test_a_closed_run_whose_router_does_not_come_back(tmp_path: Path) -> None:
    with Lab(tmp_path) as lab:
        hub, router = lab.build().router("hub")
        lab.file(duration=60, pace=1, back=3)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        hub.kill()
        assert (ends(run), ends(bring)) == (1, 1)
        last = f"\nrems: clock: the router at {router} is out of sight for 3 s\n"
        assert run.text().endswith(last)
        assert bring.text().endswith(
            "rems: robot/two: the clock is out of sight for 3 s: this host ends"
            " (R0522)\n"
        )


def test_an_open_fabric_that_is_served_again(tmp_path: Path) -> None:
    with Lab(tmp_path) as lab:
        served = lab.build().serve()
        zoe = lab.zoe(router="tcp/10.77.0.1:7447")
        served.wait_for("^robot/zoe on a is here$", SOON)
        served.kill()
        again = lab.serve()
        again.wait_for("^robot/zoe on a is here$", SOON)
        zoe.wait_for("^warning: .*: joining again$")
        again.freeze()
        lab.wait(8)
        again.thaw()
        seen = lab.module(
            *("tests.network.seen", "robot/zoe"),
            machine="b",
            router="tcp/10.77.0.1:7447",
        )
        until(lambda: seen.text().count("\n") > 30, "ticks", SOON)
        assert zoe.ended is None


def test_one_that_has_moved(tmp_path: Path) -> None:
    """Members stay where they were sent, and say what to type."""
    with Lab(tmp_path) as lab:
        served = lab.build().serve()
        lab.says("a", "router", "use", "10.77.0.1")
        zoe = lab.zoe()
        served.wait_for("^robot/zoe on a is here$", SOON)
        served.kill()
        lab.serve(machine="c")
        zoe.wait_for("^warning: the clock is out of sight; waiting for it$", SOON)
        sentence = (
            "warning: no router answers at tcp/10.77.0.1:7447 any more; waiting. If it "
            "has moved, end this by Ctrl+C, type `rems router use` with its new "
            "address, and start it again"
        )
        zoe.wait_for(f"^{re.escape(sentence)}$", SOON)
        # Whoever starts something now is told, too, and where to.
        said = lab.says("a", "list", status=2)
        assert "No router answers at tcp/10.77.0.1:7447." in said
        assert "type: rems router forget" in said
        assert "There: nobody yet." in lab.says("a", "router", "use", "10.77.0.4")
