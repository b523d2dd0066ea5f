"""docs/robots.md: its texts are the definitions', and its pictures can be drawn."""

import subprocess
import sys
from ctypes.util import find_library
from importlib.util import find_spec
from pathlib import Path

import pytest

from rems_net.bodies.body import Embodied
from rems_net.bodies.files.built import built
from tests.commands import ROOT
from tests.robots.drawing import HEIGHT, WIDTH, corners, placed
from tests.robots.gallery import PAGE, PICTURES, made, names, page
from tests.robots.looks import look
from tests.robots.looks.shapes import joints

CAN_DRAW = find_spec("mujoco") is not None and find_spec("PIL") is not None
WINDOWLESS = sys.platform == "linux" and find_library("EGL") is not None


def test_the_page_says_what_the_definitions_say() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), (
        "docs/robots.md is not as the definitions are: run `python -m "
        "tests.robots.gallery`, and look at the pictures."
    )


def test_every_robot_has_a_small_picture() -> None:
    kept = {path.stem: path.stat().st_size for path in PICTURES.glob("*.png")}
    assert kept.keys() == set(names())
    assert max(kept.values()) < 60_000


@pytest.mark.skipif(find_spec("mujoco") is None, reason="mujoco is not installed.")
@pytest.mark.parametrize("name", names())
def test_what_is_drawn_stands_on_the_floor_and_belongs_to_a_link(name: str) -> None:
    robot = made(name)
    assert isinstance(robot, Embodied)
    body = built(robot.body())
    worn = look(name, body)
    links = {joint.name for joint in joints(body.joints)} | {"base"}
    assert worn.links
    assert worn.links.keys() <= links
    model, data = placed(robot, body, worn)
    # Each robot has more than the shapes that touch, and no wheel hangs in the air.
    touching = sum(p.friction is not None for p in body.parts) + len(links) - 1
    assert model.ngeom > 1.2 * touching
    close = 0.001 + min(
        0.25 * body.height, 0.02
    )  # corners are outside of what is round
    assert abs(corners(model, data)[:, 2].min()) < close


@pytest.mark.slow
@pytest.mark.skipif(
    not (CAN_DRAW and WINDOWLESS),
    reason="drawing without a window needs Linux, EGL (libegl1), mujoco and Pillow",
)
def test_a_robot_is_drawn(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; "
        "from rems_net.robots.create2 import Create2; "
        "from tests.robots.drawing import draw; "
        "draw(Create2('create2'), Path(sys.argv[1]))"
    )
    made = tmp_path / "create2.png"
    subprocess.run([sys.executable, "-c", code, str(made)], cwd=ROOT, check=True)
    from PIL import Image

    with Image.open(made) as picture:
        assert picture.size == (WIDTH, HEIGHT)
        colours = picture.convert("RGB").getcolors(WIDTH * HEIGHT)
    assert colours is not None
    assert len(colours) > 20  # not an empty sky
