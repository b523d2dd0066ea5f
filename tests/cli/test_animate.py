"""`rems animate`: a film of a run, looked at by its pixels."""

import shutil
from contextlib import closing
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from rems_net import Experiment, YoubotArm, read
from rems_net.agents.experiment.show import Show
from rems_net.bodies.tree import Tree
from rems_net.cli import main
from rems_net.drivers.physics.pictures import painter
from rems_net.errors import MissingPartError
from rems_net.films.model import DrawnModel
from rems_net.films.space import InSpace
from rems_net.recordings.animation.film import SIZE
from rems_net.recordings.picture import COLOURS
from rems_net.robots.scaler import Scaler
from rems_net.scenes.view import of_body
from tests.commands import ROOT

Image: Any = pytest.importorskip(
    "PIL.Image", reason="Pillow is not installed (an extra)"
)


@pytest.fixture(scope="module")
def renderer() -> None:
    try:
        painter.look_for_renderer()
    except MissingPartError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two robots that drive in circles; one begins 40 cm further left."""
    folder = tmp_path_factory.mktemp("film")
    shutil.copy(ROOT / "examples" / "keys.csv", folder)
    lab = Experiment("film", dt="50 ms", duration="2 s", folder=folder)
    lab.input("keys", "csv", options={"file": "keys.csv"})
    for name, y in (("a", 0.0), ("b", 0.4)):
        start = {"y": y}
        lab.robot(name, "epuck", "kinematic", command="input/keys", initial=start)
    lab.output("rec", "mcap")
    lab.run(folder / "run", direct=True, show=Show())
    return folder / "run"


def seen(path: Path, colour: str) -> list[tuple[float, float]]:
    """Middle (x, y) of the pixels of a colour below the names, in each picture."""
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    found = []
    with Image.open(path) as film:
        assert film.size == SIZE
        for k in range(film.n_frames):
            film.seek(k)
            pixels = np.asarray(film.convert("RGB")).astype(int)
            here = np.argwhere(np.abs(pixels - rgb).sum(axis=2)[80:] < 60)
            y, x = here.mean(axis=0)
            found.append((float(x), float(y)))
    return found


@pytest.mark.parametrize("suffix", ["png", "gif", "webp"])
def test_a_film(run: Path, capsys: pytest.CaptureFixture[str], suffix: str) -> None:
    path = run / f"film.{suffix}"
    words = [] if suffix == "png" else ["--out", str(path)]
    assert main(["animate", str(run), "--speed", "4", *words]) == 0
    assert capsys.readouterr().out.startswith("film ")
    a, b = (seen(path, colour) for colour in COLOURS[:2])
    assert 8 < len(a) <= 11  # equal ones are joined
    assert a[-1][0] > a[0][0] + 5  # ahead is to the right
    assert all(y < z for (_, y), (_, z) in zip(b, a, strict=True))  # left is up


def test_the_same_bytes(run: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        words = ["--speed", "10", "--out", str(tmp_path / name)]
        assert main(["animate", str(run), *words]) == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_mp4(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--speed", "10", "--out", str(tmp_path / "film.mp4")]
    status = main(["animate", str(run), *words])
    if shutil.which("ffmpeg"):
        assert (tmp_path / "film.mp4").read_bytes()[4:8] == b"ftyp"
    else:
        assert status == 2
        assert "needs the program ffmpeg" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--out", "film.avi"], "film.avi has no format that is known"),
        (["--speed", "0"], "--speed is 0; expected a number above 0"),
        (["--speed", "0.001"], "1200 is the most; make it faster: --speed"),
        (["--out", "nowhere/film.png"], "cannot write "),
    ],
)
def test_mistakes(
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["animate", str(run), *words]) == 2
    err = capsys.readouterr().err
    assert says in err
    assert len(err.splitlines()) == 1


@pytest.mark.usefixtures("renderer")
def test_in_space(run: Path) -> None:
    """Robots are where they are from above, seen from the right and from behind."""
    path = run / "space.png"
    words = ["--3d", "--speed", "20", "--out", str(path)]
    assert main(["animate", str(run), *words]) == 0
    with Image.open(path) as film:
        assert (film.size, film.n_frames) == (SIZE, 3)
        pictures = []
        for k in (0, 2):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB"))[60:].astype(int))
    first, last = (np.argwhere(p[:, :, 0] > p[:, :, 2] + 90) for p in pictures)
    assert len(first) > 100  # the second robot is orange; it is a ghost, but apart
    assert last.mean(axis=0)[1] > first.mean(axis=0)[1] + 10


@pytest.mark.usefixtures("renderer")
def test_a_place(tmp_path: Path) -> None:
    """A robot on a ramp leans, as one bolted down it is where its place is."""
    rows = "time [s],command/wheel/left [%],command/wheel/right [%]\n2,80,80\n"
    (tmp_path / "keys.csv").write_text(rows, encoding="utf-8")
    lab = Experiment("place", dt="50 ms", duration="2 s", folder=tmp_path)
    lab.input("keys", "csv", options={"file": "keys.csv"})
    ramp = {"name": "ramp", "length": 0.4, "width": 0.4, "height": 0.1, "x": 0.3}
    ball = {"name": "ball", "radius": 0.05, "x": -0.5, "y": 0.4, "mass": 0.1}
    lab.world("arena", options={"size": [2.0, 1.6], "ramps": [ramp], "balls": [ball]})
    starts = {"bot": {"x": 0.2}, "arm": {"y": 0.5}}
    about: Any = {"command": "input/keys", "world": "arena", "initial": starts["bot"]}
    lab.robot("bot", "woodbot", "mujoco", **about)
    lab.robot("arm", YoubotArm, "mujoco", world="arena", initial=starts["arm"])
    lab.run(tmp_path / "run", direct=True, show=Show())
    with closing(InSpace(read(tmp_path / "run" / "run.mcap"))) as space:
        pictures = [space.picture(now) for now in (space.begin, space.end)]
        there = [
            space.model.data.body(name)
            for name in ("robot/bot", "robot/arm", "world/arena/ball")
        ]
        bot, arm, sphere = there
        x, _, z = bot.xpos
        height = 0.02 * sqrt(17) / 4 + (x - 0.3) / 4  # of a wheel's middle on a slope
        assert z == pytest.approx(height, abs=2e-3)
        assert bot.xmat[6] == pytest.approx(1 / sqrt(17), abs=1e-6)
        assert arm.xpos[:2] == pytest.approx([0, 0.5])
        assert sphere.xpos == pytest.approx([-0.5, 0.4, 0.05], abs=2e-3)
    assert pictures[0].shape == (SIZE[1], SIZE[0], 3)
    red = (pictures[0].astype(int) @ [2, -1, -1] > 200).sum()
    assert 50 < red < 5000  # the ball


@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
@example(0.0, -0.5625, -0.5)  # nearly stretched: Newton's method leaps
@settings(max_examples=20)
def test_links(shoulder: float, top: float, bottom: float) -> None:
    """They are where the body's own mathematics has them, also in closed loops."""
    pytest.importorskip("mujoco")
    tree, scene = Tree(Scaler("bot").body()), of_body(Scaler("bot").body())
    wanted = {"left/shoulder": shoulder, "left/top": top, "left/bottom": 1.57 + bottom}
    model = DrawnModel()
    model.body("bot", scene, (1, 0, 0, 1))
    model.build()
    for number, link in enumerate(scene["links"]):
        model.bend("bot", number, wanted.get(link["field"], 0.0))
    model.move()
    motors = {
        number: wanted.get(link["field"], 0.0)
        for number, link in enumerate(scene["links"])
        if link["field"]
    }
    places, _ = tree.places(tree.closed(motors))
    for number, place in enumerate(places):
        drawn = model.data.body(f"bot {number}").xpos
        assert drawn == pytest.approx(place, abs=1e-3)


def test_nothing_in_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of another program describes no robot; and there may be no renderer."""
    rows = "time [s],state/x [m],state/y [m],state/heading [rad]\n0.1,0,0,0\n"
    (tmp_path / "bot.csv").write_text(rows, encoding="utf-8")

    def missing() -> None:
        raise OSError("libEGL.so.1 is not there")

    for fault, says in ((None, "does not describe a robot"), (missing, "libEGL.so.1")):
        if fault is not None:
            painter.look_for_renderer.cache_clear()
            monkeypatch.setattr(painter, "_draw_something", fault)
        assert main(["animate", str(tmp_path), "--3d"]) == 2
        err = capsys.readouterr().err
        assert says in err or fault is None
        assert len(err.splitlines()) == 1
        assert (fault is None) or "leave out --3d" in err
