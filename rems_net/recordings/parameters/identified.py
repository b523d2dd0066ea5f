"""Identified: a file with the parameters that recordings showed, and their origin.

definition = "Woodbot"
digest = "5f0c..."            # of its parameters, its command and its state
[recordings]
"runs/monday/recording.mcap" = "9a1e..."
[parameters]
track = "0.1124 m"            # 0.1119 to 0.1129 m; was 0.1126 m
[noise]
"lidar/right" = { "relative" = 0.04 }     # of its standard deviation; 268 rows
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, whereabouts
from rems_net.system.reading import decoded, read_file
from rems_net.toml import TOMLDecodeError, loads

#: Keys of a file, outside its tables.
NAMES = ("robot", "definition", "digest")
#: Bytes of the longest such file.
LONGEST = 100_000


@dataclass(frozen=True)
class Origin:
    """Origin of identified parameters.

    robot: its name in the recordings      definition: name of its class
    digest: of the definition's schemas    recordings: SHA-256 of each file, by name
    versions: of rems_net and of numpy, which have computed the parameters
    """

    robot: str
    definition: str
    digest: str
    recordings: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)


def definition_digest(definition: Any) -> str:
    """Return a digest of a class's parameters, command and state, by default values."""
    parameters: Schema = definition.parameters.schema
    ports = definition.command, definition.state
    made = [parameters, *(port.schema_for(parameters()) for port in ports)]
    said = " ".join(one.digest for one in made if one is not None)
    return hashlib.sha256(said.encode()).hexdigest()[:16]


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_identified(
    path: Path,
    origin: Origin,
    parameters: Mapping[str, Any],
    noise: Mapping[str, Mapping[str, float]],
    remarks: Mapping[str, str],
) -> None:
    """Write parameters, noise and their origin. Raises OSError.

    noise: by sensor      remarks: by parameter, or sensor
    """
    lines = [
        "# Written by `rems identify`. The robot of an experiment takes it by the line",
        f"# parameters = {_toml(path.name)}",
        *(f"{key} = {_toml(getattr(origin, key))}" for key in NAMES),
    ]
    for table in ("recordings", "versions"):
        lines += ["", f"[{table}]"]
        lines += [f"{_toml(k)} = {_toml(v)}" for k, v in getattr(origin, table).items()]
    for title, values in (("parameters", parameters), ("noise", noise)):
        lines += ["", f"[{title}]"]
        for name, value in values.items():
            remark = f"  # {remarks[name]}" if name in remarks else ""
            lines.append(f"{_toml(name)} = {_toml(value)}{remark}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


#: errors of a file that is not of this kind
UNREADABLE = (OSError, TOMLDecodeError, TypeError, ValueError, RecursionError)


def read_identified(path: Path) -> tuple[Origin, dict[str, Any], dict[str, Any]]:
    """Return origin, parameters and noise of such a file. Raises ExperimentError."""
    try:
        told = loads(decoded(read_file(path, LONGEST)))
        tables = [dict(told[name]) for name in ("recordings", "versions", "parameters")]
        noise = dict(told.get("noise", {}))
        texts = [told[name] for name in NAMES]
        if not all(isinstance(text, str) for text in texts):
            raise ValueError("a name is no text")
    except FileNotFoundError:
        raise ExperimentError(
            f"There is no file {whereabouts(path, '.toml')} (R0880)"
        ) from None
    except (*UNREADABLE, KeyError) as error:
        why = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise ExperimentError(
            f"{path.name} is not what `rems identify` writes: {why:.80}. Type: "
            f"rems identify --out {path.name} (R0880)"
        ) from None
    recordings, versions, parameters = tables
    robot, definition, digest = texts
    return Origin(robot, definition, digest, recordings, versions), parameters, noise


def parameters_for(
    path: Path, definition: Any
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return parameters and noise. Raises ExperimentError for another class."""
    origin, parameters, noise = read_identified(path)
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
    return parameters, noise


def as_line(values: Mapping[str, Any]) -> str:
    """Return values as a line of TOML, for an option."""
    return ", ".join(f"{_toml(name)} = {_toml(one)}" for name, one in values.items())


def _toml(value: Any) -> str:
    """Return a value, or a key in quotes, in TOML."""
    if isinstance(value, Mapping):
        pairs = (f"{_toml(key)} = {_toml(one)}" for key, one in value.items())
        return f"{{ {', '.join(pairs)} }}"
    return json.dumps(value, ensure_ascii=False)
