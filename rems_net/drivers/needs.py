"""Errors for definitions that lack what their driver needs, with what to write."""

from rems_net.agents.robot import Definition, Driver, Robot
from rems_net.errors import SchemaError

#: message for a world that is a file
NEEDS_MUJOCO = "mjcf is a model for MuJoCo: give its robots the driver mujoco. (R0204)"


def missing(robot: Robot, method: str, why: str, example: str) -> SchemaError:
    """Return the error for a definition that lacks what its driver needs."""
    bases = type(robot).__mro__
    definition = next(
        (b for b in bases if issubclass(b, Definition) and not issubclass(b, Driver)),
        type(robot),
    )
    driver = next(
        (b for b in bases if issubclass(b, Driver) and not issubclass(b, Definition)),
        type(robot),
    )
    return SchemaError(
        f"{definition.__name__} has no {method}: the driver {driver.__name__} needs it "
        f"for {why}. Write in {definition.__name__}, for example (R0303):\n"
        f"    {example}"
    )
