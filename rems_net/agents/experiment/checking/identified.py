"""Identified: parameters in a file of `rems identify`, for the same definition only."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rems_net.agents.experiment.checking.settings import check_mapping
from rems_net.errors import ExperimentError
from rems_net.recordings.parameters.identified import definition_digest, read_identified


def stated(given: object, definition: type, folder: Path) -> Mapping[str, Any]:
    """Return parameters, which may be the name of a file; `folder` is its base.

    Raises ExperimentError, also if the file is of another definition.
    """
    if not isinstance(given, str | Path):
        check_mapping(given, "parameters")
        return given or {}  # type: ignore[return-value]
    path = folder / given
    origin, parameters = read_identified(path)
    name = definition.__name__
    if origin.definition != name:
        raise ExperimentError(
            f"{path.name} has parameters that were identified for {origin.definition}, "
            f"and this robot is a {name}; identify this robot: rems identify --robot "
            f"{origin.robot} --out {path.name} (R0880)"
        )
    if origin.digest != definition_digest(definition):
        raise ExperimentError(
            f"{path.name} was identified for another version of {name}, before its "
            "parameters, command or state changed; identify it again: rems identify "
            f"--robot {origin.robot} --out {path.name} (R0880)"
        )
    return parameters
