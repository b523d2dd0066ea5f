"""Events: printed without a listener, logged, and read back from a host's lines."""

import pytest

from rems_net.events import MARK, Event, info, listening, read_line, warn

EVENT = Event("warning", 7, "robot/a", "device", "it is gone\nagain")


def test_warnings_are_printed_without_a_listener(
    capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "rems_net")
    info("joined", "robot/a is here")
    warn("device", "robot/a is gone", "robot/a", 7)
    assert capsys.readouterr() == ("", "warning: robot/a is gone\n")
    assert [r.event.kind for r in caplog.records] == ["joined", "device"]  # type: ignore[attr-defined]
    assert caplog.messages == ["robot/a is here", "robot/a is gone"]


def test_the_last_listener_gets_them_alone(capsys: pytest.CaptureFixture[str]) -> None:
    outer: list[Event] = []
    inner: list[Event] = []
    with listening(outer.append):
        with listening(inner.append):
            warn(EVENT.kind, EVENT.text, EVENT.agent, EVENT.tick)
        info("left", "robot/a has left")
    assert inner == [EVENT]
    assert [event.kind for event in outer] == ["left"]
    assert capsys.readouterr() == ("", "")


def test_a_hosts_line_is_an_event_or_what_was_printed() -> None:
    line = EVENT.to_line().rstrip("\n")
    printed = Event("info", 0, "robot/a", "printed", "no end of line")
    assert [*read_line(line, "robot/a")] == [EVENT]
    assert [*read_line(f"no end of line{line}", "robot/a")] == [printed, EVENT]
    forged = ("", "1", "[]", '["info", 1, 2, "c", "d"]', '[["info"], 1, "b", "c", "d"]')
    more = ('["loud", 1, "b", "c", "d"]', '["info", true, "b", "c", "d"]', '{"a": 1}')
    for told in forged + more:
        text = f"x{MARK}{told}"
        assert [*read_line(text, "h")] == [Event("info", 0, "h", "printed", text)]
