"""Errors for definitions that lack what their driver needs, with what to write."""

from rems_net.agents.robot import Robot, definition_of, driver_of
from rems_net.defdict import Field, Schema
from rems_net.errors import SchemaError, uncoded

#: message for a world that is a file
NEEDS_MUJOCO = "mjcf is a model for MuJoCo: give its robots the driver mujoco. (R0204)"
#: example for a definition without a body
BODY = """def body(self):
        return Body(parts=(Part(Sphere(0.1), mass=1.0),), height=0.1)"""


def missing(robot: Robot, method: str, why: str, example: str) -> SchemaError:
    """Return the error for a definition that lacks what its driver needs."""
    cls = type(robot)
    definition, driver = definition_of(cls).__name__, driver_of(cls).__name__
    return SchemaError(
        f"{definition} has no {method}: the driver {driver} needs it for {why}. Write "
        f"in {definition}, for example (R0303):\n    {example}"
    )


def field_of(robot: Robot, who: str, port: str, path: str) -> Field:
    """Return a field that a driver needs. Raises SchemaError if there is none.

    who: what needs it, and a verb: "the body needs"
    """
    schema = robot.schemas().get(port, Schema(f"{robot.name}.{port}"))
    if port == "command":
        schema = robot.motor_schema()
    field = schema.find(path)
    if not isinstance(field, Field):
        raise SchemaError(
            f"{type(robot).__name__}: {who} the field {path!r} of {port}. "
            f"{uncoded(schema.unknown(path))} (R0306)"
        )
    return field
