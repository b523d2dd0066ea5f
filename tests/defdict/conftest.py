"""A value with groups inside groups."""

from typing import Any

import pytest

from rems_net.defdict import DefDict, Schema, angular_velocity, boolean, integer, length


def wheel() -> dict[str, Any]:
    return {"velocity": angular_velocity("rad/s", range=(-8, 8)), "on": boolean()}


ROBOT = Schema(
    "robot",
    {
        "x": length("m"),
        "wheel": {"left": wheel(), "right": wheel()},
        "arm": {"wheel": {"left": wheel()}},
        "tags": integer(),
    },
)


@pytest.fixture
def value() -> DefDict:
    return ROBOT({"wheel/left/velocity": 1.0, "x": 2})
