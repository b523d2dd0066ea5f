"""Crowds in several hosts, of which one reads what the robots of the others obey."""

from typing import Any

from rems_net import Experiment
from tests.engine.thrice import in_three_ways

#: robots, so that each of three hosts has more agents than one can declare for each
ROBOTS = 60


def crowds(where: dict[str, Any]) -> Experiment:
    lab = Experiment("crowds", dt="50 ms", duration="1 s")
    lab.input("wave", "tests.engine.parts:Wave", **where)
    for i in range(ROBOTS):
        lab.robot(
            f"r{i}",
            "tests.engine.parts:Cart",
            "kinematic",
            command="input/wave",
            initial={"x": 0.1 * i},
            **where,
        )
    lab.output("log", "csv", **where)
    return lab


def test_a_crowd_reads_the_commands_of_other_crowds() -> None:
    """It dropped some as those of other hosts' robots, and waited for them for ever."""
    names = [f"r{i}.csv" for i in range(ROBOTS)]
    made = in_three_ways(crowds, *names)
    assert len({*made.values()}) == ROBOTS
