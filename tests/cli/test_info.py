"""`rems info`: what is in a recording."""

from pathlib import Path

import pytest

from rems_net.cli import main
from tests.recordings.test_mcap import whole, write


def test_what_when_keys_rates_and_ranges(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole(tmp_path / "run.mcap")
    assert main(["info", str(tmp_path)]) == 0
    assert capsys.readouterr().out == (
        "what  lab; seed 0\n"
        "when  until 5 s of fabric time, in ticks of 0.1 s\n"
        "size  0.0147 MB, 150 values of 3 keys\n"
        "process/p/diary: 50, 10 a second\n"
        "robot/a/state: 50, 10 a second\n"
        "    heading  -50 to -1 rad\n"
        "    x  0.1429 to 7.143 m\n"
        "robot/b/state: 50, 10 a second\n"
        "    heading  -50 to -1 rad\n"
        "    x  0.1429 to 7.143 m\n"
    )


def test_a_file_without_its_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "run.mcap")
    assert main(["info", str(file.path)]) == 0
    said = capsys.readouterr().out
    assert "It has no end: its writer was killed." in said
    assert "robot/a/state: 49" in said
    file.close()


def test_a_folder_without_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(tmp_path)]) == 2
    assert f"there is no run.mcap in {tmp_path}; " in capsys.readouterr().err
    assert main(["info", str(tmp_path / "a.mcap")]) == 2
    assert "there is no file " in capsys.readouterr().err
