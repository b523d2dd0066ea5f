"""Settings of agents as parameters of viewers: listed, changed, followed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.agents.runs import until
from tests.dashboard.test_live_page import TUNED
from tests.dashboard.test_viewers import Viewed, Viewer, viewer

GAIN = "input/swing.gain"
SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("settings", dt=0.02, duration="600 s", pace=1)
lab.input("swing", "{TUNED}/tuned.py:Swing", host="here")
lab.robot("cart", "{TUNED}/tuned.py:Cart", "kinematic", command="input/swing",
    host="here")
lab.robot("bot", "woodbot", "kinematic", host="here")
lab.run("out")
"""


class Tuned(Viewed):
    """A run with a setting that changes, and an address for viewers."""

    script = SCRIPT


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tuned]:
    made = Tuned(tmp_path_factory.mktemp("settings"))
    try:
        yield made
    finally:
        made.close()


def rows(one: Viewer) -> dict[str, Any]:
    """Return the parameters of the next message."""
    words = until(lambda: one.answers and one.answers.pop(0))
    return {row["name"]: row["value"] for row in words["parameters"]}


def test_settings_are_listed_and_changed(lab: Tuned) -> None:
    with viewer(lab.link) as one:
        one.send("getParameters", parameterNames=[], id="all")
        found = rows(one)
        assert found["robot/bot.track"] == "0.1126 m"
        one.send("getParameters", parameterNames=[GAIN, "nobody.x"], id="one")
        assert rows(one) == {GAIN: found[GAIN]}
        new = [{"name": GAIN, "value": 0.25}]
        one.send("setParameters", parameters=new, id="set")
        assert rows(one) == {GAIN: 0.25}


def test_a_viewer_follows_what_another_changes(lab: Tuned) -> None:
    with viewer(lab.link) as one, viewer(lab.link) as other:
        one.send("subscribeParameterUpdates", parameterNames=[GAIN])
        value = 0.5

        def changed() -> bool:
            nonlocal value
            value = 1.25 - value  # once more, if it did not follow yet
            new = [{"name": GAIN, "value": value}]
            other.send("setParameters", parameters=new, id="set")
            rows(other)
            return bool(one.answers)

        until(changed)
        assert set(rows(one)) == {GAIN}


def test_what_cannot_be_changed_is_a_sentence(lab: Tuned) -> None:
    with viewer(lab.link) as one:
        for name, value, sentence in (
            ("robot/bot.track", "0.1 m", "cannot be changed while its agent runs"),
            ("robot/bot.tracks", 1, "'robot/bot.tracks' is no parameter here"),
            (GAIN, "1 m", "'gain' expects a number from 0 to 2"),
            ("swing.gain", 1, f"Did you mean '{GAIN}'?"),
        ):
            one.said.clear()
            one.send("setParameters", parameters=[{"name": name, "value": value}])
            until(lambda: one.said)
            assert sentence in one.said[0]
        one.send("setParameters", parameters=[7])
        assert one.hears("parameters is no list")
        one.send("getParameters", parameterNames=7)
        assert one.hears("parameterNames is no list")
