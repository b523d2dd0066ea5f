"""PicturesOutput: whole PNG files, named by robot, camera and tick."""

from __future__ import annotations

import errno
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, In, Output
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, Schema, array, length
from rems_net.errors import AgentError, ExperimentError, UnknownFieldError
from rems_net.outputs.csv import CsvOutput
from rems_net.outputs.pictures import PicturesOutput
from rems_net.pictures import is_picture, pixels, png
from rems_net.recordings.manifest import read_manifest
from rems_net.recordings.recording import read
from tests.agents.runs import until

SEEN = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3) * 14
EYES = Schema("eyes", {"far": length(), "eye": {"left": array((2, 3, 3), dtype="u1")}})


def output(folder: Path, restarts: int = 0, **ports: DefDict) -> PicturesOutput:
    """An output that hears these ports of one robot, `bot`."""
    made = PicturesOutput("album", out=folder)
    runtime(made).restarts = restarts
    made.prepare()
    made.open()
    values: dict[str, Any] = {f"robot/bot/{port}": v for port, v in ports.items()}
    made.__dict__["robots"] = values
    return made


def test_a_picture_per_tick(tmp_path: Path) -> None:
    album = output(tmp_path, sensors=EYES({"eye/left": SEEN}))
    album.write(Tick(9, 0.9, 0.1))
    album.write(Tick(10, 1.0, 0.1))
    album.close()
    assert album.made() == [tmp_path / "bot.eye.left"]
    names = [p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*.*")]
    assert sorted(names) == [
        "bot.eye.left",
        "bot.eye.left/000009.png",
        "bot.eye.left/000010.png",
    ]
    one, other = sorted((tmp_path / "bot.eye.left").iterdir())
    assert one.read_bytes() == other.read_bytes() == png(SEEN)


class Peek(Output):
    """Keeps what the run's own note says while it runs."""

    robots = In(source="robot/*/state")

    def write(self, tick: Tick) -> None:
        told = read_manifest(self.out)
        assert told is not None
        (self.out / "peek.txt").write_text("\n".join(told.files))


def test_in_a_run_and_after_one_that_was_killed(tmp_path: Path) -> None:
    """What a run would leave it says as it begins: a later one moves that."""
    lab = Experiment("dark", dt="0.1 s", duration="0.4 s")
    lab.robot("bot", "epuck_camera", "kinematic", host=HERE)
    lab.output("album", "pictures", every=2, host=HERE)
    lab.output("peek", Peek, host=HERE)
    made = lab.run(tmp_path / "out").files
    assert made == [tmp_path / "out" / "bot.camera", tmp_path / "out" / "run.mcap"]
    names = [path.name for path in sorted(made[0].iterdir())]
    assert names == ["000002.png", "000004.png"]
    begun = (tmp_path / "out" / "peek.txt").read_text().splitlines()
    assert begun == ["bot.camera", "run.mcap"]
    seen = read(tmp_path / "out").pictures("bot.camera")
    assert {tick: one.shape for tick, one in seen.items()} == dict.fromkeys(
        (2, 4), (39, 52, 3)
    )
    with pytest.raises(UnknownFieldError, match=r"'bot' in .*; there is bot.camera"):
        read(tmp_path / "out").pictures("bot")
    (made[0] / "000004.png").write_bytes(b"no picture")
    with pytest.raises(ExperimentError, match=r"000004.png is no picture that a run"):
        assert seen[4]


def test_the_file_is_what_others_read() -> None:
    image = pytest.importorskip("PIL.Image", reason="Pillow is not installed")
    from io import BytesIO

    for shape in ((1, 1, 3), (2, 3, 3), (39, 52, 3)):
        picture = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
        with image.open(BytesIO(png(picture))) as found:
            assert found.mode == "RGB"
            assert (np.asarray(found) == picture).all()


def test_its_chunks_are_those_of_the_standard() -> None:
    """Without a library: signature, size, and each row after how it is filtered."""
    file = png(SEEN)
    assert file[:16] == b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"
    assert file[16:29] == b"\0\0\0\3\0\0\0\2\x08\2\0\0\0"  # 3 wide, 2 high
    rows = zlib.decompress(file[41:-16])
    assert rows == b"\0" + SEEN[0].tobytes() + b"\0" + SEEN[1].tobytes()
    assert (pixels(file) == SEEN).all()
    for cut in (0, 7, 20, 40, 45):
        with pytest.raises(ValueError, match=r"^$"):
            pixels(file[:cut])


def test_what_is_a_picture() -> None:
    assert is_picture(SEEN)
    assert is_picture(array((2, 3, 3), dtype="u1"))
    assert not is_picture(array((2, 3, 4), dtype="u1"))
    assert not is_picture(array((2, 3, 3)))
    assert not is_picture(length())


def test_a_table_has_no_column_for_it(tmp_path: Path) -> None:
    log = CsvOutput("log", out=tmp_path)
    log.prepare()
    log.open()
    log.__dict__ |= {"robots": {"robot/bot/sensors": EYES({"far": 0.5})}, "worlds": {}}
    log.write(Tick(1, 0.1, 0.1))
    log.close()
    assert (tmp_path / "bot.csv").read_text() == "time [s],sensors/far [m]\n0.1,0.5\n"


def test_it_goes_on_after_a_crash_and_takes_no_folder_of_others(
    tmp_path: Path,
) -> None:
    eyes = EYES({"eye/left": SEEN})
    output(tmp_path, sensors=eyes).write(Tick(1, 0.1, 0.1))
    output(tmp_path, restarts=1, sensors=eyes).write(Tick(2, 0.2, 0.1))
    assert len(list((tmp_path / "bot.eye.left").iterdir())) == 2
    with pytest.raises(AgentError, match="is there already"):
        output(tmp_path, sensors=eyes).write(Tick(3, 0.3, 0.1))


def test_a_full_disk_leaves_whole_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    album = output(tmp_path, sensors=EYES({"eye/left": SEEN}))
    album.write(Tick(1, 0.1, 0.1))

    def half(path: Path, picture: bytes) -> int:
        with path.open("wb") as file:
            file.write(picture[:20])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(AgentError, match=r"000002\.png: No space left on device"):
        album.write(Tick(2, 0.2, 0.1))
    assert [p.name for p in (tmp_path / "bot.eye.left").iterdir()] == ["000001.png"]


def test_nobody_has_a_camera(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    album = output(tmp_path, state=Schema("state", {"x": length()})())
    for n in range(3):
        album.write(Tick(n, n / 10, 0.1))
    said = (
        "warning: output/album: there is no picture to keep; it reads robot/bot/state"
    )
    assert capfd.readouterr().err.splitlines() == [said]
    assert album.made() == []


def test_a_kill_leaves_whole_pictures(tmp_path: Path) -> None:
    """Noise does not compress, so a picture takes long enough to be cut in two."""
    script = (
        "import sys; from pathlib import Path; import numpy as np\n"
        "from rems_net.agents.tick import Tick\n"
        "from rems_net.defdict import Schema, array\n"
        "from rems_net.outputs.pictures import PicturesOutput\n"
        "eyes = Schema('eyes', {'eye': array((300, 400, 3), dtype='u1')})\n"
        "noise = np.random.default_rng(1).integers(0, 256, (300, 400, 3), np.uint8)\n"
        "album = PicturesOutput('album', out=Path(sys.argv[1]))\n"
        "album.prepare(); album.open()\n"
        "album.__dict__['robots'] = {'robot/bot/sensors': eyes({'eye': noise})}\n"
        "for n in range(100_000): album.write(Tick(n, n / 10, 0.1))\n"
    )
    folder = tmp_path / "bot.eye"
    with subprocess.Popen([sys.executable, "-c", script, str(tmp_path)]) as process:
        try:
            until(lambda: len(list(folder.glob("*.png"))) >= 5)
        finally:
            process.kill()
    files = sorted(folder.glob("*.png"))
    assert len(files) >= 5
    assert len({path.read_bytes() for path in files}) == 1
