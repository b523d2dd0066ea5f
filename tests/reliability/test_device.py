"""The device itself: it obeys, answers, and stands still when nobody tells it."""

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.reliability.rig.rig import Rig

pytest.importorskip("pty", reason="there are no pseudo-terminals here")
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="it reads CLOCK_BOOTTIME, which is Linux's",
)


class Line:
    """The other end of the device's line."""

    def __init__(self, port: str, log: Path):
        self.line, self.log = os.open(port, os.O_RDWR | os.O_NOCTTY), log

    def ask(self, words: str) -> str:
        os.write(self.line, words.encode() + b"\n")
        answer = b""
        while not answer.endswith(b"\n"):
            answer += os.read(self.line, 256)
        return answer.decode().strip()

    def noted(self) -> list[tuple[bool, str]]:
        lines = self.log.read_text(encoding="utf-8").splitlines()
        return [(note["moves"], note["why"]) for note in map(json.loads, lines)]


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    with Rig(tmp_path) as rig:
        log = tmp_path / "device.jsonl"
        device = rig.module("tests.reliability.programs.device", log)
        ports = json.loads(device.wait_for("^{.*").group())["ports"]
        line = Line(ports[0], log)
        yield line
        os.close(line.line)


def test_it_moves_and_stands_as_told(line: Line) -> None:
    assert line.ask("V 0.5 0.1").startswith("S ")
    assert line.ask("V 0 0").endswith(" 0.000000 0.000000")
    assert line.noted() == [(True, "told"), (False, "told")]


def test_it_moves_in_wall_time(line: Line) -> None:
    def far() -> bool:
        return float(line.ask("V 0.5 0").split()[1]) > 0.1

    until(far)
    assert line.noted() == [(True, "told")]


def test_its_watchdog_stands_it_still(line: Line) -> None:
    line.ask("V 0.5 0.1")
    until(lambda: line.noted()[-1] == (False, "watchdog"))
    notes = [json.loads(text) for text in line.log.read_text("utf-8").splitlines()]
    assert notes[1]["monotonic"] - notes[0]["monotonic"] >= 0.5
    assert notes[1]["boottime"] - notes[0]["boottime"] >= 0.5


@pytest.mark.parametrize(
    "words", ["V nan 0", "V inf 0", "V 1", "", "X 1 1", "V a b", "V 1 1 1", "\xff"]
)
def test_what_it_does_not_understand_changes_nothing(line: Line, words: str) -> None:
    assert line.ask(words).startswith("E ")
    assert line.noted() == []
