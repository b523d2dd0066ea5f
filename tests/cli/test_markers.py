"""A page of markers is one that a camera can read."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rems_net.cli import main
from rems_net.eyes.drawn import found

pytest.importorskip("apriltag")
#: pixels for a millimetre
SCALE = 4
SHAPE = re.compile(r"M([\d.]+) ([\d.]+)h([\d.]+)v([\d.]+)h-")


def printed(page: Path) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """The page as a picture: its black rectangles on white."""
    picture = np.full((297 * SCALE, 210 * SCALE), 255, np.uint8)
    for numbers in SHAPE.findall(page.read_text(encoding="utf-8")):
        x, y, width, height = (SCALE * float(one) for one in numbers)
        picture[round(y) : round(y + height), round(x) : round(x + width)] = 0
    return picture


@pytest.mark.parametrize("family", ["tag36h11", "tag25h9", "aruco4x4"])
def test_a_page_has_its_markers_at_their_size(
    family: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if family == "aruco4x4":
        pytest.importorskip("cv2")
    monkeypatch.chdir(tmp_path)
    assert main(["markers", "0-3,5", "--size", "40mm", "--family", family]) == 0
    page = tmp_path / "markers.svg"
    assert "This line is 100 mm long" in page.read_text(encoding="utf-8")
    seen = found(family, printed(page))
    assert sorted(number for number, _ in seen) == [0, 1, 2, 3, 5]
    for _, corners in seen:
        assert corners[1, 0] - corners[0, 0] == pytest.approx(40 * SCALE, rel=0.03)
        assert corners[0, 1] > corners[3, 1]  # upright: its lower left is below


def test_many_markers_are_several_pages(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["markers", "0-29", "--size", "60 mm", "--out", "big.svg"]) == 0
    names = capsys.readouterr().out.split()
    assert names[:2] == ["big.svg", "big_2.svg"]
    each = [found("tag36h11", printed(Path(name))) for name in names]
    assert sorted(n for some in each for n, _ in some) == [*range(30)]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["x"], "'x' names no markers; write ids such as 0-9 or 3,7. (R1106)"),
        (["600"], "markers 0 to 586; got id = 600. (R1102)"),
        (["3", "--size", "40"], "expected a length with its unit, such as 40mm."),
        (["3", "--size", "200mm"], "choose a smaller size. (R1106)"),
        (["3", "--size", "0mm"], 'such as "40 mm"; got 0 m. (R1102)'),
    ],
)
def test_a_page_that_cannot_be(
    words: list[str],
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["markers", *words]) == 2
    assert sentence in capsys.readouterr().err


def test_without_opencv_nothing_else_is_printed() -> None:
    """The library of AprilTags advises to install it, for what nobody calls here."""
    words = "import sys; sys.modules['cv2'] = None\n"
    words += "from rems_net.eyes.apriltags import cells; cells('tag36h11', 3)"
    ran = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True)
    assert (ran.returncode, ran.stdout + ran.stderr) == (0, "")
