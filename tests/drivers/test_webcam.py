"""Webcams: what is refused, without one; and lenses from pictures of a board."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.agents.robot import combine
from rems_net.bodies.lens import Lens
from rems_net.cli import main
from rems_net.drivers.hardware.camera.webcam import Webcam
from rems_net.errors import AgentError, SchemaError
from rems_net.eyes.opencv import check_size, lens_of_board
from rems_net.eyes.view import View, turn_of
from rems_net.pictures import png
from rems_net.robots.eyes.camera import Camera

pytest.importorskip("cv2")


def test_no_webcam_is_a_sentence_with_a_list_to_check() -> None:
    robot = combine(Camera, Webcam)("cam", options={"number": 99})
    robot.prepare()
    with pytest.raises(AgentError) as caught:
        robot.open()
    robot.close()
    text = str(caught.value)
    assert "no webcam 99 opens" in text
    assert "2. that no other program uses it" in text


def test_another_size_than_asked_is_refused_with_what_to_write() -> None:
    check_size((480, 640, 3), (640, 480))
    with pytest.raises(OSError, match="gives pictures of 1280 x 720, and 640 x 480"):
        check_size((720, 1280, 3), (640, 480))


def test_only_a_camera_can_be_a_webcam() -> None:
    lab = Experiment("eyes", duration=1.0)
    lab.robot("bot", "woodbot", "webcam")
    with pytest.raises(ValueError, match="still"):
        lab.check()


def board(view: View) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """A chessboard of 7 by 5 inner corners, 30 mm each, on the floor, as it is seen."""
    rows, columns = np.mgrid[:480, :640]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(float)
    met = view.meet(view.straightened(pixels), 0.0)
    assert met is not None
    cell = np.floor(met / 0.03).astype(int) + np.array([4, 3])
    inside = ((cell >= 0) & (cell < (8, 6))).all(axis=1)
    dark = inside & (cell.sum(axis=1) % 2 == 0)
    return np.where(dark, 30, 220).astype(np.uint8).reshape(480, 640)


def test_a_lens_comes_from_pictures_of_a_board(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lens = Lens(640, 480, 560.0, 565.0, 325.0, 236.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
    pictures: list[Any] = []
    for heading, pitch in [(0, -90), (30, -60), (120, -60), (210, -55), (300, -65)] * 2:
        turn = turn_of(*np.radians([heading, pitch, 5 * len(pictures)]))
        eye = np.array([0.01, -0.01, 0.0]) - 0.45 * turn[:, 0]
        pictures.append(board(View.at(lens, eye, turn)))
    found, left = lens_of_board(pictures, 7, 5)
    assert left < 0.5
    assert (found.fx, found.fy) == pytest.approx((lens.fx, lens.fy), rel=0.01)
    assert (found.cx, found.cy) == pytest.approx((lens.cx, lens.cy), abs=4)
    monkeypatch.chdir(tmp_path)
    for number, picture in enumerate(pictures):
        colours = np.repeat(picture[:, :, None], 3, axis=2)
        (tmp_path / f"{number}.png").write_bytes(png(colours))
    assert main(["lens", ".", "--board", "7x5"]) == 0
    line, note = capsys.readouterr().out.splitlines()
    assert line.startswith("parameters = { width = 640, height = 480, fx = ")
    assert f"fx = {found.fx:.2f}" in line
    assert note.startswith("# 10 pictures; corners deviate by 0.")
    assert main(["lens", "nowhere"]) == 2
    assert "there are no pictures in nowhere" in capsys.readouterr().err
    with pytest.raises(SchemaError, match=r"0 of 2 pictures show a board.*R1107"):
        lens_of_board([np.zeros((480, 640), np.uint8)] * 2, 7, 5)
