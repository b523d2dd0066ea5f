"""An experiment in a TOML file: a thin layer over `Experiment`.

[experiment]
name = "lab"
duration = "10 s"

[[robot]]
name = "model"
definition = "woodbot"
driver = "kinematic"
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import signature
from pathlib import Path
from typing import Any

from rems_net.agents import parts, registry
from rems_net.agents.agent import PHASES
from rems_net.agents.background.overdue import naming_overdue
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.source.methods import check_nested
from rems_net.agents.protocol.plan import COMMON, ROBOT as CLASSES, robot_classes
from rems_net.agents.world import World
from rems_net.errors import ExperimentError, RemsError, nearest, whereabouts
from rems_net.system.reading import DESCRIPTION, decoded, read_file
from rems_net.toml import TOMLDecodeError, loads, meant

#: Keys of a table: the arguments of the method behind it.
EXPERIMENT = tuple(p for p in signature(Experiment).parameters if p != "folder")
ROBOT = tuple(p for p in signature(Experiment.robot).parameters if p != "self")
TABLES = ("experiment", *PHASES)

#: Old keys of [experiment], and what to write instead.
_MOVED = {"patience": ' Write wait = { back = "30 s" }.'}

#: Reports of Python's reader about a backslash, and the likely meaning.
_ESCAPES = ("Unescaped '\\'", "hex value", "Unicode scalar")
_BACKSLASH = (
    " Is it a path? Write it in single quotes, 'data\\keys.csv', or with slashes, "
    '"data/keys.csv".'
)

#: Words of messages for Python, and their replacements for TOML.
_IN_TOML = (
    (" To limit it, use clip().", ""),
    ("give it range=.", "give it a range."),
    (" Use round().", " Write a whole number."),
    ("expects True or False", "expects true or false"),
)

#: A table of settings in a message, such as `options={"file": "keys.csv"}`.
_TABLE = re.compile(r'(\w+)=\{("\w+": [^{}]*)\}')

#: How `Experiment` begins a sentence about one of its agents.
_AGENT = re.compile(rf"({'|'.join(PHASES)}) '([^']*)': ")


def load(path: Path | str) -> Experiment:
    """Read an experiment: a TOML file, or a script up to its first run().

    Raises ExperimentError naming the file, table and key.
    """
    if not isinstance(path, str | Path):
        raise ExperimentError(
            f"an experiment is an Experiment(...), or its file, such as 'lab.toml'; "
            f"got {path!r:.60}. (R0402)"
        )
    with naming_overdue():
        return (
            _of_script(Path(path)) if f"{path}".endswith(".py") else _load(Path(path))
        )


def _of_script(path: Path) -> Experiment:
    found = registry.experiments_of(path, Experiment)
    if len(found) == 1:
        experiment: Experiment = found[0]
        return experiment
    names = ", ".join(one.name for one in found)
    raise ExperimentError(
        f"{path} makes "
        f"{f'{len(found)} experiments ({names})' if found else 'no experiment'} "
        "at its top level; expected one, or the run() of the one that is meant. (R0450)"
    )


def _load(path: Path) -> Experiment:
    tables = _read(path)
    with located(path):
        _check_tables(tables)
    settings = tables.get("experiment", {})
    with located(path, "[experiment]"):
        _check_keys(settings, EXPERIMENT, "[experiment]")
        settings = {"name": path.stem, **settings}
        experiment = Experiment(**settings, folder=path.resolve().parent)
    for kind in PHASES:
        for i, table in enumerate(tables.get(kind, ())):
            name = table.get("name")
            which = f'"{name}"' if isinstance(name, str) else f"number {i + 1}"
            with located(path, f"[[{kind}]] {which}"):
                _add(experiment, kind, dict(table))
    return experiment


@contextmanager
def located(path: Path | str, where: str = "") -> Iterator[None]:
    """Begin every error with the file and, if known, the table in it."""
    try:
        yield
    except RemsError as error:
        sentence = str(error)
        match = _AGENT.match(sentence)
        if match:
            sentence = sentence[match.end() :]
            where = where or f'[[{match[1]}]] "{match[2]}"'
        place = f"{path}, {where}" if where else f"{path}"
        for python, toml in _IN_TOML:
            sentence = sentence.replace(python, toml)
        sentence = _TABLE.sub(_in_toml, sentence)
        raise ExperimentError(f"{place}: {sentence}") from None


def _in_toml(table: re.Match[str]) -> str:
    inner = re.sub(r'"(\w+)": ', r"\1 = ", table[2])
    inner = re.sub(r"= (True|False)\b", lambda one: one[0].lower(), inner)
    return f"{table[1]} = {{ {inner} }}"


def _read(path: Path) -> dict[str, Any]:
    try:
        text = decoded(read_file(path, DESCRIPTION))
        return loads(text)
    except FileNotFoundError:
        found = whereabouts(path, ".toml", ".py")
        raise ExperimentError(f"There is no file {found} (R0401)") from None
    except OSError as error:
        if path.is_dir():  # Windows reports a folder as a lack of permission
            raise ExperimentError(
                f"{path} is a folder; expected an experiment file, such as lab.toml."
                " (R0402)"
            ) from None
        raise ExperimentError(
            f"Cannot read {path}: {error.strerror}. (R0402)"
        ) from None
    except UnicodeDecodeError as error:
        raise ExperimentError(
            f"{path} is no text in UTF-8 (at byte {error.start + 1}); save it as UTF-8."
            " (R0402)"
        ) from None
    except TOMLDecodeError as error:
        what, _, at = str(error).rpartition(" (at ")
        what, at = (what, f", {at.rstrip(')')}") if what else (str(error), "")
        line = re.match(r", line (\d+)", at)
        hint = _BACKSLASH * any(word in what for word in _ESCAPES) or meant(
            text, int(line[1]) if line else 0, twice="overwrite" in what
        )
        raise ExperimentError(
            f"{path}{at}: this is no TOML: {what}.{hint} (R0403)"
        ) from None


def _check_tables(tables: Mapping[str, Any]) -> None:
    for key, value in tables.items():
        if key not in TABLES:
            raise ExperimentError(
                f"there is no table [{key}]; expected [experiment], "
                f"{', '.join(f'[[{k}]]' for k in PHASES)}.{nearest(key, TABLES)}"
                " (R0404)"
            )
        if key == "experiment":
            if not isinstance(value, dict):
                raise ExperimentError(
                    f"[experiment] is one table, with single brackets; got {value!r}."
                    " (R0404)"
                )
        elif not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            raise ExperimentError(
                f"there may be several of {key}: write [[{key}]], with double brackets."
                " (R0404)"
            )


def _add(experiment: Experiment, kind: str, table: dict[str, Any]) -> None:
    folder = experiment.folder
    declared: dict[str, type[Any]] = {"options": World}
    known: tuple[str, ...] = ("name", "options", "ghosts")
    needed: dict[str, str] = {}
    if kind == "robot":
        known = ROBOT
        needed = {word: next(iter(registry.BUILT_IN[word])) for word in CLASSES}
        if all(isinstance(table.get(word), str) for word in CLASSES):
            classes = robot_classes(table["definition"], table["driver"], folder)
            declared = {"parameters": classes[0], "options": classes[1]}
    elif kind != "world":
        _need(table, "type", "csv" if kind != "process" else "my_file.py:MyProcess")
        cls = parts.find(kind, table["type"], folder)
        declared = {"options": cls}
        known = ("name", "type", *cls.ins(), "options", *COMMON)
    check_nested(table, declared, known)
    settings = (getattr(cls, slot, None) for slot, cls in declared.items())
    own = [w for one in settings if one for w in one.schema.entries]
    _check_keys(table, known, "it", own)
    for key, example in {**needed, "name": "left"}.items():
        _need(table, key, example)
    getattr(experiment, kind)(**table)


def _check_keys(
    table: Mapping[str, Any], known: Sequence[str], what: str, also: Sequence[str] = ()
) -> None:
    for key in table:
        if key not in known:
            hint = _MOVED.get(key) or nearest(key, [*known, *also])
            raise ExperimentError(
                f"there is no key {key!r}; {what} may have {', '.join(known)}."
                f"{hint} (R0405)"
            )


def _need(table: Mapping[str, Any], key: str, example: str) -> None:
    if key not in table:
        hint = nearest(key, table)
        raise ExperimentError(
            f'{key} is missing; write a line such as {key} = "{example}".{hint} (R0405)'
        )
    if not isinstance(table[key], str):
        raise ExperimentError(
            f"{key} is {table[key]!r}; expected text in quotes. (R0405)"
        )
