"""Webcams: what is refused, without one; and lenses from pictures of a board."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, read
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.robot import combine
from rems_net.bodies.lens import Lens
from rems_net.cli import main
from rems_net.drivers.hardware.camera.webcam import Webcam
from rems_net.errors import AgentError, SchemaError
from rems_net.eyes.opencv import Webcam as Device, lens_of_board
from rems_net.eyes.view import View, turn_of
from rems_net.pictures import png
from rems_net.robots.eyes.camera import Camera
from tests.eyes.paper import SCALE, SIZE, Go, pasted

cv2 = pytest.importorskip("cv2")


def test_no_webcam_is_a_sentence_with_a_list_to_check() -> None:
    robot = combine(Camera, Webcam)("cam", options={"number": 99})
    robot.prepare()
    with pytest.raises(AgentError) as caught:
        robot.open()
    robot.close()
    text = str(caught.value)
    assert "no webcam 99 opens" in text
    assert "2. that no other program uses it" in text


def film(folder: Path, pictures: Sequence[Any]) -> str:
    """Write pictures as files, and return their name as an option has it."""
    for number, grey in enumerate(pictures):
        colours = np.repeat(grey[:, :, None], 3, axis=2)
        (folder / f"shot-{number:03d}.png").write_bytes(png(colours))
    return "shot-%03d.png"


def test_a_film_of_another_size_is_refused(tmp_path: Path) -> None:
    shots = film(tmp_path, [np.full((240, 320), 99, np.uint8)] * 3)
    robot = combine(Camera, Webcam)("cam", options={"film": shots}, folder=tmp_path)
    robot.prepare()
    with pytest.raises(AgentError, match="gives pictures of 320 x 240, and 640 x 480"):
        robot.open()
    robot.close()


def test_no_film_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "torn.avi").write_bytes(b"RIFF")
    for name in ("none.avi", "torn.avi"):
        with pytest.raises(OSError, match=f"no film .*{name} opens"):
            Device(str(tmp_path / name), 640, 480)


def test_a_film_gives_each_picture_once(tmp_path: Path) -> None:
    path = tmp_path / "film.avi"
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), code, 30, (64, 48))
    for level in (50, 120, 200):
        writer.write(np.full((48, 64, 3), level, np.uint8))
    writer.release()
    device, levels = Device(str(path), 64, 48), []
    while (picture := device.read()) is not None:
        levels.append(int(picture.mean()))
    device.close()
    assert levels == pytest.approx([50, 120, 200], abs=3)


def test_from_a_film_to_poses_and_a_robot_that_stops(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """30 pictures in 2 s, 2 pixels apart: then the camera is frozen."""
    pytest.importorskip("apriltag")
    ways = [(shot * 2 + 0.25) / SCALE for shot in range(30)]
    shots = film(tmp_path, [pasted([(3, way, 0.0)]) for way in ways])
    folder = Path(__file__).parent
    lab = Experiment("film", dt="50 ms", duration="3.6 s", pace=1, folder=folder)
    marker = {"id": 3, "size": SIZE, "height": 1e-9}
    more: dict[str, Any] = {"marker": marker, "command": "process/go"}
    lab.robot("bot", "woodbot", "kinematic", host=HERE, **more)
    lens = {"fx": 1200.0, "place": {"z": 1.0}}
    options = {"film": str(tmp_path / shots), "rate": 15, "delay": "0.1 s"}
    lab.robot("cam", "camera", "webcam", parameters=lens, options=options)
    seen = {"robots": "bot"}
    camera = "robot/cam/sensors"
    lab.process("eyes", "localise", camera=camera, options=seen, host=HERE)
    lab.process("go", Go, host=HERE)
    run = lab.run(tmp_path / "out")
    poses, bot = read(run.folder)["process/eyes"], read(run.folder)["bot"]
    x, at = np.array(poses.plain("bot/x")), np.array(poses.plain("bot/tick"))
    assert (np.diff(x[at > 0]) >= -1e-4).all()
    assert x[-1] == pytest.approx(ways[-1], abs=1e-3)
    assert len(np.unique(at)) > 5
    assert min(np.array(poses.plain("bot/age"))[at > 0]) >= 0.0999  # by the delay
    end = int(at[-1])
    assert 10 < end < 50  # of 72
    moves = np.abs(np.diff(bot.plain("state/x"))) > 1e-4
    assert moves[8:end].mean() > 0.8
    assert not moves[end + 13 :].any()  # 0.5 s later, and a tick for each on the way
    assert "the camera is frozen, and poses age" in caplog.text


def test_only_a_camera_can_be_a_webcam() -> None:
    lab = Experiment("eyes", duration=1.0)
    lab.robot("bot", "woodbot", "webcam")
    with pytest.raises(ValueError, match="still"):
        lab.check()


def board(view: View, rays: Any) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """A chessboard of 7 by 5 inner corners, 30 mm each, on the floor, as it is seen.

    rays: all pixels, straightened
    """
    met = view.meet(rays, 0.0)
    assert met is not None
    cell = np.floor(met / 0.03).astype(int) + np.array([4, 3])
    inside = ((cell >= 0) & (cell < (8, 6))).all(axis=1)
    dark = inside & (cell.sum(axis=1) % 2 == 0)
    return np.where(dark, 30, 220).astype(np.uint8).reshape(480, 640)


def test_a_lens_comes_from_pictures_of_a_board(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lens = Lens(640, 480, 560.0, 565.0, 325.0, 236.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
    rows, columns = np.mgrid[:480, :640]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
    rays = View.at(lens, np.zeros(3), np.eye(3)).straightened(pixels)  # for any pose
    pictures: list[Any] = []
    for heading, pitch in [(0, -90), (30, -60), (120, -60), (210, -55), (300, -65)] * 2:
        turn = turn_of(*np.radians([heading, pitch, 5 * len(pictures)]))
        eye = np.array([0.01, -0.01, 0.0]) - 0.45 * turn[:, 0]
        pictures.append(board(View.at(lens, eye, turn), rays))
    found, left = lens_of_board(pictures, 7, 5)
    assert left < 0.5
    assert (found.fx, found.fy) == pytest.approx((lens.fx, lens.fy), rel=0.01)
    assert (found.cx, found.cy) == pytest.approx((lens.cx, lens.cy), abs=4)
    with pytest.raises(SchemaError, match=r"from one side, within 0 degrees.*R1107"):
        lens_of_board(pictures[:1] * 6, 7, 5)
    monkeypatch.chdir(tmp_path)
    for number, picture in enumerate(pictures):
        colours = np.repeat(picture[:, :, None], 3, axis=2)
        (tmp_path / f"{number}.png").write_bytes(png(colours))
    assert main(["lens", ".", "--board", "7x5"]) == 0
    line, note = capsys.readouterr().out.splitlines()
    assert line.startswith("parameters = { width = 640, height = 480, fx = ")
    assert f"fx = {found.fx:.2f}" in line
    assert note.startswith("# 10 pictures; corners deviate by 0.")
    assert main(["lens", ".", "--board", "2x9"]) == 2
    assert "inner corners, one less" in capsys.readouterr().err
    assert main(["lens", "nowhere"]) == 2
    assert "there are no pictures in nowhere" in capsys.readouterr().err
    with pytest.raises(SchemaError, match=r"0 of 2 pictures show a board.*R1107"):
        lens_of_board([np.zeros((480, 640), np.uint8)] * 2, 7, 5)
