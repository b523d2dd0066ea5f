"""Runs over several machines: what a network does to them costs time, and no byte."""

import re
from pathlib import Path

import pytest

from tests.network.lab import SOON, WIFI, WORSE, Lab
from tests.reliability.rig.programs import Program, until
from tests.reliability.rig.rig import MACHINES

pytestmark = MACHINES
#: seconds for a run that is cut off, loses packets, and is measured on a busy machine
LONG = 240.0


def ends(program: Program) -> int:
    return program.process.wait(LONG)


def alone(
    lab: Lab,
    router: str,
    duration: float,
    pace: object = '"fast"',
    back: float = 30,
) -> str:
    """The recording of the same experiment on one machine."""
    lab.file(duration=duration, pace=pace, back=back)
    words = ("run", "lab.toml", "--alone", "--out", "alone", "--pace", "fast")
    lab.says("c", *words, router=router)
    return lab.digest("alone")


@pytest.mark.parametrize(
    ("link", "duration"),
    [(None, 10), (WIFI, 10), (WORSE, 3)],
    ids=["", "wifi", "worse"],
)
def test_the_same_bytes_over_machines(
    tmp_path: Path, link: dict[str, float] | None, duration: float
) -> None:
    with Lab(tmp_path) as lab:
        _, router = lab.build().router("hub")
        expected = alone(lab, router, duration=duration)
        if link:
            lab.link("hub", **link)
        run, bring = lab.run_and_bring(router)
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.digest("here") == expected


def test_a_fabric_of_a_team_beside_the_class(tmp_path: Path) -> None:
    """Remembered on both laptops: neither says where its router is."""
    with Lab(tmp_path) as lab:
        served = lab.build().serve()
        for machine in ("a", "b"):
            lab.says(machine, "router", "use", "10.77.0.1", "--fabric", "team")
        lab.file(duration=2)
        run, bring = lab.run_and_bring("")
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.rows() == 40
        assert "robot/two" not in served.text()


@pytest.mark.parametrize("who", ["a", "b"])
@pytest.mark.parametrize("seconds", [1, 5, 30])
def test_a_partition_costs_time(tmp_path: Path, who: str, seconds: float) -> None:
    """Of the machine with the clock, and of that with the robot."""
    with Lab(tmp_path) as lab:
        _, router = lab.build().router("hub")
        expected = alone(lab, router, duration=6, pace=1, back=60)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        lab.cut(who)
        lab.wait(seconds)
        rows = lab.rows()
        assert rows < 60
        lab.heal()
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.digest("here") == expected
        assert "is held by" in run.text()
        if seconds >= 5:
            assert re.search("the clock is out of sight; waiting for it", bring.text())
            assert re.search(r"the clock is back, after \d+ s", bring.text())


@pytest.mark.parametrize("who", ["a", "b"])
def test_another_address_costs_time(tmp_path: Path, who: str) -> None:
    """Of the machine with the clock, and of that with the robot; seen: R0522."""
    with Lab(tmp_path) as lab:
        _, router = lab.build().router("hub")
        expected = alone(lab, router, duration=6, pace=1)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        lab.move(who, "10.77.0.9")
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.digest("here") == expected


@pytest.mark.parametrize("what", ["sends", "hears"])
def test_a_one_way_cut(tmp_path: Path, what: str) -> None:
    with Lab(tmp_path) as lab:
        _, router = lab.build().router("hub")
        expected = alone(lab, router, duration=6, pace=1)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        lab.cut(*("b", "*") if what == "sends" else ("*", "b"), one_way=True)
        lab.wait(5)
        assert lab.rows() < 60
        lab.heal()
        assert (ends(run), ends(bring)) == (0, 0), run.text() + bring.text()
        assert lab.digest("here") == expected


@pytest.mark.parametrize("who", ["a", "b"])
def test_a_partition_that_is_too_long_ends_it_on_both_sides(
    tmp_path: Path, who: str
) -> None:
    with Lab(tmp_path) as lab:
        _, router = lab.build().router("hub")
        lab.file(duration=60, pace=1, back=3)
        run, bring = lab.run_and_bring(router)
        until(lambda: lab.rows() > 20, "rows", SOON)
        lab.cut(who)
        assert (ends(run), ends(bring)) == (1, 1)
        cause = (
            "robot/two: is out of sight on b for 3 s"
            if who == "b"
            else f"clock: the router at {router} is out of sight for 3 s"
        )
        assert run.text().endswith(f"\nrems: {cause}\n")
        assert re.search(
            r"\n\[robot/two\] warning: the clock is out of sight for \d s: this host "
            r"ends\nrems: robot/two: the clock is out of sight for \d s: this host "
            r"ends\n$",
            bring.text(),
        )
        # What was recorded before is there, in whole rows.
        lines = (tmp_path / "here/two.csv").read_text("utf-8").splitlines(keepends=True)
        assert len(lines) > 20
        assert all(line.endswith("\n") for line in lines)
        assert len({line.count(",") for line in lines}) == 1
