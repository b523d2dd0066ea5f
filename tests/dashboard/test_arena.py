"""The arena in a real browser: from above and in 3-D, with a place that is a file."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rems_net.agents.about.scenery import scene_of
from rems_net.bodies.tree import Tree
from rems_net.robots.scaler import BEGIN, Scaler
from tests.agents.runs import until
from tests.commands import command, environment, link_of
from tests.dashboard.browser import Browser, Chromium, browser

ROOM = """<mujoco>
  <asset><mesh name="roof" vertex="0 0 0  1 0 0  0 1 0  0 0 0.5"/></asset>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <geom type="box" size="1 0.05 0.1" pos="0 1 0.1"/>
    <geom type="mesh" mesh="roof" pos="1 1 0"/>
    <body name="crate" pos="0.1 0 0.05"><freejoint/>
      <geom type="box" size="0.03 0.1 0.05" mass="0.02"/></body>
  </worldbody></mujoco>"""
SCRIPT = """
from rems_net import Experiment, Input, Out, Schema, YoubotArm, sin
from rems_net.units import percent

class Ahead(Input):
    value = Out(Schema("ahead", {"wheel/left": percent(), "wheel/right": percent()}))
    def read(self, tick):
        return {"wheel/left": 40.0, "wheel/right": 40.0}

class Swing(Input):
    value = Out(YoubotArm.command)
    def read(self, tick):
        return {"arm/joint/2": 0.5 * sin(tick.t), "arm/speed": 1.0}

lab = Experiment("room", dt=0.02, duration="600 s", pace=1, record=False)
lab.world("room", options={"mjcf": "room.xml"})
lab.input("ahead", Ahead, host="here")
lab.input("swing", Swing, host="here")
lab.robot("bot", "woodbot", "mujoco", world="room", command="input/ahead")
lab.robot("arm", "youbot_arm", "kinematic", command="input/swing", host="here")
lab.run("out")
"""
DEEP = "rems.arena.isDeep"
SOLID = "document.querySelector('#arena-tools button')"
CANVAS = "document.querySelector('#arena-canvas')"
YAW, FAR = "rems.arena.deep.view.yaw", "rems.arena.deep.now.far"
#: The picture, in the task that draws it: its pixels are gone after that.
PICTURE = "rems.arena.draw(), document.querySelector('#arena-solid').toDataURL()"
#: A robot's links, as the page places them for these positions of its joints.
LINKS = """import('./body.js').then(({{ linksOf }}) => {{
  const [scene, positions, bent] = [{scene}, {positions}, []];
  return linksOf(scene.links, scene.loops, (link) => positions[link.field], bent);
}})"""


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The link of a page that shows a run."""
    pytest.importorskip("mujoco")
    folder = tmp_path_factory.mktemp("arena")
    (folder / "room.xml").write_text(ROOM, encoding="utf-8")
    (folder / "lab.py").write_text(SCRIPT, encoding="utf-8")
    run = subprocess.Popen(
        command("run", "lab.py", "--dashboard"),
        cwd=folder,
        env=environment(XDG_RUNTIME_DIR=str(folder)),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    try:
        yield link_of(run)
    finally:
        run.terminate()
        run.communicate()


@pytest.fixture(scope="module")
def tab(link: str, chromium: Chromium) -> Iterator[Browser]:
    with chromium.apart() as made:
        made.size(1280, 800)
        made.go(link)
        until(lambda: made.run("rems.arena.robots().length == 2"), 60)
        until(lambda: made.run("Object.keys(rems.arena.scenes).length == 3"))
        yield made
        assert made.errors == []


def test_a_place_that_is_a_file_is_drawn_and_a_pushed_crate_moves(tab: Browser) -> None:
    room = tab.run("rems.arena.scenes['world/room']")
    assert len(room["walls"]) == 2
    assert [len(mesh["faces"]) for mesh in room["meshes"]] == [12]
    crate = "rems.arena.things()[0]"
    assert tab.run(f"{crate}.name") == "crate"
    tab.until(f"{crate}.pose.x > 0.105")


def test_an_arm_is_shown_in_3d_and_a_button_switches(tab: Browser) -> None:
    tab.until(DEEP)
    tab.until(f"{FAR} > 1.5")
    for deep in (False, True):
        tab.click(SOLID)
        tab.until(f"{DEEP} === {str(deep).lower()}")
        assert tab.run(f"{SOLID}.getAttribute('aria-pressed')") == str(deep).lower()
        assert tab.run("rems.arena.deep.canvas.canvas.hidden") is not deep
    assert tab.run("document.querySelector('#arena-note').textContent") == ""


def test_it_is_turned_by_mouse_and_finger_and_zoomed_by_the_wheel(tab: Browser) -> None:
    tab.until(DEEP)
    x, y = tab.place(CANVAS)
    yaw, before = tab.run(YAW), tab.run(PICTURE)
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x + 60, y)
    tab.mouse("mouseReleased", x + 60, y)
    tab.until(f"{YAW} < {yaw} - 0.3")
    assert tab.run(PICTURE) != before
    yaw = tab.run(YAW)
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        ("touchMove", [{"x": x - 60, "y": y}]),
        ("touchEnd", []),
    ):
        tab.send("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    tab.until(f"{YAW} > {yaw} + 0.3")
    far = tab.run(FAR)

    def near() -> bool:
        """Turn the wheel; a browser without time drops a turn after a touch."""
        tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-300)
        return bool(tab.run(f"{FAR} < {far} * 0.7"))

    until(near)
    tab.run(f"{CANVAS}.focus()")
    tab.key("0", "Digit0", "0")
    tab.until(f"{FAR} > {far} * 0.8")


@pytest.mark.parametrize("bottom", [1.2, 1.9])
def test_the_page_bends_joints_and_closes_loops(tab: Browser, bottom: float) -> None:
    """As the tree of the body does, which the engines use."""
    robot = Scaler("scaler")
    robot.prepare()
    scene, tree = json.loads(json.dumps(scene_of(robot))), Tree(robot.body())
    some = dict.fromkeys(robot.state.schema.paths, 0.0)
    for arm in ("left", "right"):
        some |= dict(zip((p for p in some if p.startswith(arm)), BEGIN, strict=True))
        some |= {f"{arm}/shoulder": 0.4, f"{arm}/bottom": bottom, f"{arm}/wrist/2": 1.0}
    fields = [link["field"] for link in scene["links"]]
    wanted = {n: some[field] for n, field in enumerate(fields) if field}
    points, _ = tree.places(tree.closed(wanted))
    words = LINKS.format(scene=json.dumps(scene), positions=json.dumps(some))
    found = np.array(tab.run(words))[:, 12:15]
    assert found == pytest.approx(points, abs=2e-3)


def test_without_webgl_it_says_so_and_shows_it_from_above(
    link: str, tmp_path: Path
) -> None:
    with browser(tmp_path, "--disable-3d-apis") as tab:
        tab.size(360, 740)
        tab.go(link)
        note = "document.querySelector('#arena-note').textContent"
        assert until(lambda: tab.run(note), 60) == (
            "This browser has no WebGL2, so the arena is shown from above."
        )
        assert not tab.run(DEEP)
        tab.until(f"{CANVAS}.getAttribute('aria-label').includes('from above')")
