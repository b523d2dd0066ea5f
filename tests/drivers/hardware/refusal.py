"""What a robot says whose device cannot be reached."""

from typing import Any

import pytest

from rems_net.errors import AgentError


def refusal(robot: Any) -> str:
    """What it says instead of opening, once it is prepared."""
    with pytest.raises(AgentError) as caught:
        robot.open()
    robot.close()
    said = str(caught.value)
    assert said.startswith("robot/b: there is no connection to its device: ")
    assert "\n" not in said
    return said.partition("device: ")[2]
