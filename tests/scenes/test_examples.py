"""Every example can be drawn: by what its robots and worlds answer at `@scene`."""

import json
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, Woodbot
from rems_net.agents import registry
from rems_net.agents.about.scenery import scene_by, scene_of
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.file import load
from rems_net.agents.robot import Robot
from rems_net.agents.world import World
from rems_net.bodies.body import Embodied
from rems_net.errors import ExperimentError
from rems_net.robots.eyes.camera import Camera
from tests.commands import ROOT, drivers_of, needs
from tests.firmware.golden import schemas

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
#: open.toml has no robots of its own; a script with emulated devices takes long; one
#: that learns does not begin with a run
FILES = [
    pytest.param(
        path, marks=[pytest.mark.slow] if "emulated" in path.read_text("utf-8") else []
    )
    for path in [*EXAMPLES, ROOT / "examples" / "lab.toml"]
    if "rems_net.gym" not in path.read_text("utf-8")
]
POSE = {"x", "y"}


def experiment(path: Path) -> Experiment:
    """The first experiment of a script or a file, as it would run."""
    if path.suffix == ".toml":
        return load(path)
    with (
        registry.running_by(registry.end_script),
        pytest.raises(registry.ScriptEnd) as end,
    ):
        runpy.run_path(str(path), run_name="__main__")
    lab = end.value.args[0]
    assert isinstance(lab, Experiment)
    return lab


def scenes(lab: Experiment) -> Iterator[tuple[Agent, dict[str, Any]]]:
    """What robots and worlds answer, as a page reads it."""
    for agent in lab.check().values():
        if isinstance(agent, Robot | World):
            yield agent, json.loads(json.dumps(scene_of(agent)))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_an_example_is_drawn(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs(*drivers_of(path.read_text(encoding="utf-8")))
    monkeypatch.chdir(tmp_path)
    try:
        found = list(scenes(experiment(path)))
    except ExperimentError as error:
        if sys.platform != "win32" or "needs a renderer" not in str(error):
            raise
        pytest.skip(f"drawing without a window needs {error}")
    assert found
    for agent, scene in found:
        if isinstance(agent, World):
            assert scene["radius"] or scene["walls"] or scene["things"]
            continue
        assert isinstance(agent, Robot)
        # Without both, a page would not know where it is.
        assert "place" in scene or set(agent.state.schema.paths) >= POSE, agent.key
        if isinstance(agent, Embodied) and not isinstance(agent, Camera):
            assert len(scene["outline"]) > 2, agent.key
            assert scene["solids"], agent.key
        assert agent.shared is not None or "arena" in scene


def test_a_board_looks_like_its_definition() -> None:
    """It describes its ports and nothing else: these are what its firmware has."""
    robot = Woodbot("sim")
    robot.prepare()
    assert scene_by(schemas()) == {"made_of": "Woodbot", **scene_of(robot)}
    assert scene_by({}) == {}
    assert scene_by({"state": schemas()["state"]}) == {}
