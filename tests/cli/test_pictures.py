"""What `rems get` and `rems watch` say of pictures, and how one is saved."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net.cli.get import save
from rems_net.cli.options import show_value
from rems_net.defdict import Schema, array, length
from rems_net.errors import ExperimentError
from rems_net.pictures import png

SEEN = np.arange(39 * 52 * 3).reshape(39, 52, 3) % 200 + 3
EYES = Schema("eyes", {"far": length(), "eye": array((39, 52, 3), dtype="u1")})
KEY = "rems/robot/bot/sensors"


def told() -> dict[str, Any]:
    """What the owner of a port answers."""
    return {"tick": 1, "time": 0.1, "values": EYES({"eye": SEEN}).describe()}


def test_a_picture_is_told_in_a_line() -> None:
    values = told()["values"]
    assert show_value(values["eye"]) == "39 x 52 x 3 numbers, 3 to 202"
    assert show_value(values["far"]) == "0 m"


def test_what_fits_into_a_line_is_told_whole() -> None:
    assert show_value({"value": [0.5, 1.5], "unit": "m"}) == "[0.5, 1.5] m"
    ragged = [[1], [2, 3]] * 10
    assert show_value({"value": ragged, "unit": ""}) == str(ragged)


def test_save(tmp_path: Path) -> None:
    save(KEY, {KEY: told()}, tmp_path / "seen.png")
    assert (tmp_path / "seen.png").read_bytes() == png(SEEN.astype(np.uint8))


@pytest.mark.parametrize(
    ("found", "name", "problem"),
    [
        ({KEY: told(), f"{KEY}2": told()}, "seen.png", "there are 2 pictures"),
        ({"rems/clock/tick": {"tick": 3}}, "seen.png", "there are no pictures"),
        ({"rems/clock/roster": [{"agent": "a"}]}, "seen.png", "are no pictures"),
        ({KEY: told()}, "seen.jpg", "end the name with .png"),
        ({KEY: told()}, "nowhere/seen.png", "cannot write .*: No such file"),
    ],
)
def test_what_cannot_be_saved(
    tmp_path: Path, found: dict[str, Any], name: str, problem: str
) -> None:
    with pytest.raises(ExperimentError, match=problem):
        save(KEY, found, tmp_path / name)
    assert not list(tmp_path.glob("seen.*"))
