"""Recorded: identification of a robot in a recording, which may name its definition."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net import __version__
from rems_net.agents.parts import find
from rems_net.agents.robot import Definition
from rems_net.errors import ExperimentError, nearest, shown, some
from rems_net.identification.drive import Drive, drive_of
from rems_net.identification.identify import identify as search
from rems_net.identification.noise import noise_of
from rems_net.identification.prediction import made
from rems_net.identification.result import Identified
from rems_net.recordings.parameters.identified import (
    Origin,
    definition_digest,
    file_digest,
)

if TYPE_CHECKING:
    from rems_net.recordings.recording import Recording


def identify(
    recording: "Recording",
    robot: str = "",
    *,
    definition: type[Definition] | str = "",
    parameters: Mapping[str, Any] | None = None,
    fit: Sequence[str] = (),
    check: "Recording | None" = None,
    suggest: bool = False,
    driver: str = "",
    progress: Callable[[str], None] | None = None,
) -> Identified:
    """Find parameters of a robot from how it drove; `print(...)` shows a report.

    definition, parameters: as they were, if the recording does not have them.
    fit: names of the parameters; all that have an effect, if empty.
    check: another recording, which is only predicted; without it, each third is
    predicted from the others.
    suggest: which of 20 short drives would show most.
    driver: that predicts by simulation, such as mujoco; it is slow, and knows masses
    and friction. progress: gets a line now and then. Raises ExperimentError.

    found = rems_net.identify(rems_net.read("runs/demo"), "mujoco")
    """
    for one in (recording, check):
        if isinstance(one, str | Path | list):
            raise ExperimentError(
                f"identify() takes a recording; got {one!r:.60}. Write "
                'rems_net.read("runs/demo"). (R0865)'
            )
    name = _name(recording, robot)
    cls, stated = _definition(recording, name, definition)
    stated |= parameters or {}
    drive = _drive(recording, name, cls, stated)
    checks = [] if check is None else [_drive(check, name, cls, stated)]
    found = search(
        [drive],
        cls,
        parameters=stated,
        names=fit,
        check=checks,
        suggest=suggest,
        driver=driver,
        progress=progress,
    )
    best = made(cls, {**stated, **found.adopted()})
    found.noise = noise_of(recording[drive.name], best)
    used = [recording] if check is None else [recording, check]
    found.origin, found.stated = _origin(used, drive.name, cls), stated
    return found


def _origin(
    recordings: "Sequence[Recording]", name: str, definition: type[Definition]
) -> Origin:
    files = {}
    for recording in recordings:
        path, _ = recording.source(_named(recording, name))
        files[Path(shown(path)).as_posix()] = file_digest(path)
    digest = definition_digest(definition)
    versions = {"rems_net": __version__, "numpy": np.__version__}
    return Origin(name, definition.__name__, digest, files, versions)


def _name(recording: "Recording", asked: str) -> str:
    names = [*recording]
    if asked and asked not in names:
        raise ExperimentError(
            f"{asked} is not in the recording; it has {some(names)}."
            f"{nearest(asked, names)} (R0865)"
        )
    if not asked and len(names) != 1:
        raise ExperimentError(
            f"this recording has several robots, {some(names)}; choose one: --robot "
            f"{names[-1]} (R0865)"
        )
    return asked or names[0]


def _definition(
    recording: "Recording", name: str, given: type[Definition] | str
) -> tuple[type[Definition], dict[str, Any]]:
    """Return the robot's definition, and the parameters that the recording states."""
    plans = recording.manifest().agents.get("robot", ())
    plan = next((dict(one) for one in plans if one.get("name") == name), {})
    stated = dict(plan.get("parameters") or {})
    if isinstance(given, type):
        return given, stated
    reference = given or plan.get("definition", "")
    if not reference:
        raise ExperimentError(
            f"the recording does not have the definition of {name}; name it: "
            "--definition woodbot (R0865)"
        )
    found = find("definition", reference, Path.cwd())
    assert issubclass(found, Definition)
    return found, stated


def _drive(
    recording: "Recording",
    name: str,
    definition: type[Definition],
    parameters: Mapping[str, Any],
) -> Drive:
    columns = recording[_named(recording, name)]
    return drive_of(columns, made(definition, parameters))


def _named(recording: "Recording", name: str) -> str:
    """Return the robot's name: a file of another program has one of its own."""
    names = [*recording]
    return names[0] if name not in names and len(names) == 1 else name
