"""Two laptops with definitions that differ: the field is named, and what to do."""

import pytest

from rems_net.agents.protocol.alike import unlike
from rems_net.defdict import Schema, angle, length

HERE = Schema("cart.state", {"x": length("m"), "heading": angle()})


@pytest.mark.parametrize(
    ("there", "what"),
    [
        ({"x": length("mm"), "heading": angle()}, "'x' is float [mm] there, and float"),
        ({"x": length("m")}, "it has no 'heading' there"),
        ({"x": length(), "heading": angle(), "y": length()}, "'y' is there only"),
    ],
)
def test_the_first_field_that_differs(there: dict[str, object], what: str) -> None:
    other = Schema("cart.state", there).to_wire()
    said = str(unlike("robot/cart", "state", HERE, other, "bens"))
    assert said.startswith(
        "robot/cart is defined differently on bens and on the clock's machine: " + what
    )
    assert said.endswith(". Give both the same files. (R0445)")
