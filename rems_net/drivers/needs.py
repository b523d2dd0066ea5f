"""What a driver says when it is missing something: what, and what to write or type."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from rems_net.agents.parts import no_wheels
from rems_net.agents.robot import Definition, Driver, Robot
from rems_net.errors import MissingPartError, SchemaError
from rems_net.uncaught import hiding

#: of a world that is a file
NEEDS_MUJOCO = "mjcf is a model for MuJoCo: give its robots the driver mujoco."


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
        f"for {why}. Write in {definition.__name__}, for example:\n    {example}"
    )


def look_for(library: str, extra: str) -> None:
    """Raise MissingPartError if an optional library is not installed. Loads nothing."""
    if find_spec(library) is None:
        raise MissingPartError(
            no_wheels(library)
            or f"The driver {extra} needs the library {library}, which is not "
            f'installed. Type: pip install "rems-net[{extra}]"'
        )


def load(library: str, extra: str) -> Any:
    """Import an optional library, or raise MissingPartError saying why it failed."""
    look_for(library, extra)
    try:
        return import_module(library)
    except ImportError as why:
        raise MissingPartError(
            hiding(why)
            or f"The library {library} is installed but cannot be loaded: {why}. "
            f'Type: pip install --force-reinstall "rems-net[{extra}]"'
        ) from why
