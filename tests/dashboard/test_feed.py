"""The page's server takes of a crowd what some page or viewer shows."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from rems_net import Experiment
from rems_net.agents.host.outlet import CROWD
from rems_net.agents.protocol.plan import HERE
from rems_net.client import Fabric
from rems_net.dashboard.feed import Feed
from rems_net.dashboard.viewers.ports import Ports
from tests.agents.runs import until
from tests.client.test_fabric import try_join


@contextmanager
def crowd(folder: Path) -> Iterator[Fabric]:
    """Run robots in one host, beside this thread; the run ends with the block."""
    lab = Experiment("feed", dt=0.02, duration="60 s", pace=1)
    for i in range(CROWD + 1):
        lab.robot(f"r{i}", "woodbot", "kinematic", host=HERE)
    thread = threading.Thread(target=lambda: lab.run(folder))
    thread.start()
    with until(try_join) as fabric:
        yield fabric
        fabric.clock("end")
    thread.join()


def test_only_states_of_a_crowd_until_a_page_looks_at_one_of_it(tmp_path: Path) -> None:
    with crowd(tmp_path) as fabric:
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


def test_viewers_see_each_robot_of_a_crowd(tmp_path: Path) -> None:
    with crowd(tmp_path) as fabric, ThreadPoolExecutor(4) as threads:
        ports = Ports(fabric, threads.submit)

        def known() -> set[int]:
            ports.drain()
            ends = "r3/state", f"r{CROWD}/state"
            every = ports.channels.items()
            return {i for i, one in every if one["topic"].endswith(ends)}

        until(lambda: known() and len(ports.channels) == 1 + 3 * (CROWD + 1))
        assert len(known()) == 2
        ports.want(wanted := known())
        until(lambda: ports.drain().keys() >= wanted)
        ports.close()
