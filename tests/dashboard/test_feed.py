"""The page's server takes of a crowd what some page shows."""

import threading
from pathlib import Path

from rems_net import Experiment
from rems_net.agents.host.outlet import CROWD
from rems_net.dashboard.feed import Feed
from tests.agents.runs import until
from tests.client.test_fabric import try_join


def test_only_states_of_a_crowd_until_a_page_looks_at_one_of_it(tmp_path: Path) -> None:
    lab = Experiment("feed", dt=0.02, duration="60 s", pace=1)
    for i in range(CROWD + 1):
        lab.robot(f"r{i}", "woodbot", "kinematic", host="all")
    thread = threading.Thread(target=lambda: lab.run(tmp_path))
    thread.start()
    with until(try_join) as fabric:
        feed = Feed(fabric.session, lambda channel, payload: None)

        came: list[str] = []

        def often() -> bool:
            came.extend(feed.channels[i].key for i in feed.drain())
            return came.count("robot/@crowd/state") > 20

        feed.open()
        until(often)
        assert {*came} == {"robot/@crowd/state", "clock/tick"}
        feed.want({"robot/r7"})
        until(lambda: often() and "robot/@crowd/sensors" in came)
        feed.want(set())
        feed.close()
        fabric.clock("end")
    thread.join()
