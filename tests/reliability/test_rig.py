"""The rig: nothing is left of it, links do what they are told, and the page is kept."""

import json
import re
import shutil
import signal
import statistics
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from tests.agents.runs import alive, until
from tests.reliability import network, page
from tests.reliability.rig.keeper import marked
from tests.reliability.rig.link import Link
from tests.reliability.rig.rig import ROOT, Rig, missing

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="it reads /proc, which is Linux's"
)
needs_machines = pytest.mark.skipif(bool(missing()), reason=missing())
SLEEPS = [
    sys.executable,
    "-c",
    "import time; print('sleeps', flush=True); time.sleep(99)",
]
#: starts a program that starts another one, freezes both, and waits to be killed
BUILDER = """
import sys, time
from pathlib import Path
from tests.reliability.rig.rig import HERE, Rig
machines = sys.argv[2:]
with Rig(Path(sys.argv[1])) as rig:
    if machines:
        rig.connect(*machines)
    nested = "import subprocess as s, sys; s.run([sys.executable, '-c', sys.argv[1]])"
    sleeps = "import time; print('sleeps', flush=True); time.sleep(99)"
    where = machines[0] if machines else HERE
    program = rig.start("nest", [sys.executable, "-c", nested, sleeps], where)
    program.wait_for("sleeps")
    rig.freeze(where)
    print(rig.mark, rig.runtime, flush=True)
    time.sleep(99)
"""


def namespaces() -> set[str]:
    """The network namespaces of all processes."""
    found = set()
    for path in Path("/proc").glob("[0-9]*/ns/net"):
        try:
            found.add(str(path.readlink()))
        except OSError:
            continue
    return found


def own_devices() -> set[str]:
    """The network devices outside of all machines."""
    return {path.name for path in Path("/sys/class/net").iterdir()}


def is_gone_when_killed(folder: Path, *machines: str) -> None:
    """Build a rig in another process, kill that, and wait for the end of it all."""
    process = subprocess.Popen(
        [sys.executable, "-c", BUILDER, str(folder), *machines],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert process.stdout is not None
    mark, runtime = process.stdout.readline().split()
    assert len(marked(mark)) >= 2 + bool(machines)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    until(lambda: not marked(mark))
    until(lambda: not Path(runtime).exists())


def test_nothing_is_left_after_an_error(tmp_path: Path) -> None:
    rig = Rig(tmp_path)

    def fail() -> None:
        with rig:
            program = rig.start("sleeps", SLEEPS)
            program.wait_for("sleeps")
            program.freeze()
            assert marked(rig.mark) == [program.pid]
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not marked(rig.mark)
    assert not alive(rig.programs[0].pid)
    assert not rig.runtime.exists()


def test_nothing_is_left_when_its_builder_is_killed(tmp_path: Path) -> None:
    is_gone_when_killed(tmp_path)


def test_a_program_that_ended_says_so(tmp_path: Path) -> None:
    with Rig(tmp_path) as rig:
        program = rig.start("hello", [sys.executable, "-c", "print('hello')"])
        with pytest.raises(RuntimeError, match=r"hello has ended:\nhello"):
            program.wait_for("goodbye")


@given(
    delay=st.floats(0, 1),
    jitter=st.floats(0, 1),
    gaps=st.lists(st.floats(0, 0.1), min_size=1, max_size=50),
)
def test_packets_keep_their_order(
    delay: float, jitter: float, gaps: list[float]
) -> None:
    link = Link(delay, min(jitter, delay))
    now, last = 0.0, 0.0
    for gap in gaps:
        now += gap
        due = link.due(now, 100)
        assert due is not None
        assert due >= last
        assert due >= now + link.delay - link.jitter - 1e-9
        last = due


def test_a_rate_makes_packets_wait_then_drops_them() -> None:
    link = Link(rate=8000)
    due = [link.due(0.0, 100) for _ in range(5)]
    assert due[:3] == pytest.approx([0.1, 0.2, 0.3])
    assert due[3:] == [None, None]
    assert link.lost == 2


@pytest.mark.parametrize(
    ("told", "sentence"),
    [
        ({"loss": 1.5}, "loss is 1.5"),
        ({"delay": -1.0}, "delay is -1.0"),
        ({"jitter": 0.1}, "jitter 0.1 is above delay 0.0"),
        ({"colour": 1.0}, "a link has no colour"),
    ],
)
def test_a_link_refuses(told: dict[str, float], sentence: str) -> None:
    with pytest.raises(ValueError, match=re.escape(sentence)):
        Link().change(**told)


def test_a_table_replaces_only_itself(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("# A page\n\nBy hand.\n", encoding="utf-8")
    page.write(path, page.Section("a", "First", "Old.", "| x |"))
    page.write(path, page.Section("b", "Second", "Two.", "| y |"))
    path.write_text(path.read_text("utf-8") + "\nMore by hand.\n", encoding="utf-8")
    page.write(path, page.Section("a", "First", "New \\1.", "| z |"))
    text = path.read_text("utf-8")
    order = ["By hand.", "New \\1.", "| z |", "Two.", "| y |", "More by hand."]
    assert [text.count(words) for words in order] == [1] * len(order)
    assert sorted(order, key=text.index) == order
    assert "Old." not in text


def test_a_table_without_an_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("<!-- measured: a -->\nwhat is mine?\n", encoding="utf-8")
    with pytest.raises(ValueError, match="no '<!-- end of a -->' after it"):
        page.write(path, page.Section("a", "First", "Text.", "| x |"))
    assert "what is mine?" in path.read_text("utf-8")


def test_cells_that_were_not_measured_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("# A page\n", encoding="utf-8")
    old = page.table(["fault", "one", "two"], [["a", "1", "2"], ["b", "3", "4"]])
    page.write(path, page.Section("x", "First", "Old.", old))
    new = page.table(["fault", "one", "two"], [["b", "", "5"], ["c", "6", ""]])
    section = page.Section("x", "First", "New.", new)
    rows = page.mend(path, section, placed=True).lines.splitlines()[2:]
    assert rows == ["| a | 1 | 2 |", "| b | 3 | 5 |", "| c | 6 |  |"]
    rows = page.mend(path, section, placed=False).lines.splitlines()[2:]
    assert rows == ["| a | 1 | 2 |", "| b |  | 5 |", "| c | 6 |  |"]


def echoes(rig: Rig, address: str) -> int:
    """How many of 20 UDP packets from `other` to this address come back."""
    words = network.PROBE, "udp", address, 20, 0.01
    probe = rig.module(*words, machine="other")
    return len(json.loads(probe.wait_for("^{.*").group())["round_trip"])


@pytest.mark.slow
@pytest.mark.root
@needs_machines
class TestMachines:
    """Out of network namespaces."""

    def test_nothing_is_left(self, tmp_path: Path) -> None:
        before, devices = namespaces(), own_devices()
        with Rig(tmp_path / "one") as rig:
            rig.connect("one", "other")
            program = rig.start("sleeps", SLEEPS, "other")
            program.wait_for("sleeps")
            inside = str(Path(f"/proc/{program.pid}/ns/net").readlink())
            assert inside not in before
            assert own_devices() == devices
        assert not marked(rig.mark)
        assert inside not in namespaces()
        is_gone_when_killed(tmp_path / "two", "one", "other")
        until(lambda: namespaces() <= before)
        assert own_devices() == devices

    def test_machines_have_names_of_their_own(self, tmp_path: Path) -> None:
        with Rig(tmp_path) as rig:
            rig.connect("one", "other")
            code = "import platform; print(platform.node())"
            program = rig.start("name", [sys.executable, "-c", code], "other")
            program.wait_for("^other$")

    def test_links_do_what_they_are_told(self, tmp_path: Path) -> None:
        """The bounds are wide: a busy machine adds milliseconds of its own."""
        plain, wifi = network.measure(
            400, tmp_path, [network.LINKS[0], network.LINKS[2]], seconds=1.0
        )
        assert plain.lost == 0.0
        assert statistics.median(plain.one_way) < 0.002
        assert plain.rate > 50e6
        assert min(wifi.one_way) >= 0.01
        assert 0.018 < network.part(wifi.one_way, 0.5) < 0.025
        # Of 400 each way, 2 % of each: 4 % of round trips, give or take 3 deviations.
        assert 0.01 <= wifi.lost <= 0.075

    def test_cut_and_heal(self, tmp_path: Path) -> None:
        with Rig(tmp_path) as rig:
            rig.connect("one", "other")
            at = rig.addresses["one"]
            serve = rig.module(network.PROBE, "serve", at, machine="one")
            serve.wait_for("^ready")

            def back() -> int:
                return echoes(rig, at)

            assert back()
            rig.cut("one")
            assert not back()
            rig.heal()
            assert back()
            rig.cut("one", "other", one_way=True)
            assert not back()
            counts = rig.change("*", "*")
            assert counts["other>one"][0] > counts["one>other"][0]

    @pytest.mark.skipif(not shutil.which("iptables"), reason="there is no iptables")
    def test_a_firewall_drops(self, tmp_path: Path) -> None:
        with Rig(tmp_path) as rig:
            rig.connect("one", "other")
            at = rig.addresses["one"]
            serve = rig.module(network.PROBE, "serve", at, machine="one")
            serve.wait_for("^ready")
            rig.drop("one", "other")
            assert not echoes(rig, at)
            rig.drop("one", "other", undo=True)
            assert echoes(rig, at)

    def test_what_is_wrong_is_said(self, tmp_path: Path) -> None:
        with Rig(tmp_path) as rig:
            rig.connect("one", "other")
            with pytest.raises(RuntimeError, match="there is no machine 'third'"):
                rig.cut("third")
