"""`rems animate`: a film of a run, looked at by its pixels."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.cli import main
from rems_net.recordings.animation.film import SIZE
from rems_net.recordings.picture import COLOURS
from tests.commands import ROOT

Image: Any = pytest.importorskip(
    "PIL.Image", reason="Pillow is not installed (an extra)"
)


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
