"""A router that is restarted, frozen, or moved to another address."""

import re
from pathlib import Path

from tests.network.lab import SOON, Lab
from tests.reliability.rig.programs import until
from tests.reliability.rig.rig import MACHINES

pytestmark = MACHINES


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
