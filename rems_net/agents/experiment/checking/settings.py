"""Checks of an experiment's settings: durations, paces, folders, names."""

import errno
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from math import floor, inf
from pathlib import Path
from typing import Any

from rems_net.agents.diagnosis import describe
from rems_net.agents.protocol.limits import SHORTEST, check_pace
from rems_net.agents.protocol.terms import Wait
from rems_net.agents.rules import check_rules
from rems_net.defdict import parse_quantity
from rems_net.errors import ExperimentError, RemsError, nearest
from rems_net.recordings.parameters.identified import as_line, parameters_for
from rems_net.router.keys import check_name

#: by word, a value that it may have
EXAMPLES = {
    "marker": '{"id": 3, "size": "40 mm"}',
    "initial": '{"x": "10 cm"}',
    "options": '{"noise": True}',
}


@contextmanager
def origin(what: str) -> Iterator[None]:
    """Begin every error with the agent that it is about: `robot 'sim': ...`."""
    try:
        yield
    except RemsError as error:
        raise ExperimentError(f"{what}: {error}") from None
    except Exception as error:  # from a class of the user
        raise ExperimentError(f"{what}: {describe(error)}") from error


def seconds(value: object, what: str) -> float:
    """Return a positive number of seconds, from a number or text with a unit."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ExperimentError(
            f'{what} is {value!r}; expected seconds, such as "0.1 s". (R0408)'
        )
    try:
        number = parse_quantity(value, "s")
    except RemsError as error:
        raise ExperimentError(f"{what}: {error}") from None
    if not SHORTEST <= number < 1e9:
        raise ExperimentError(f"{what} is {value!r}; expected 1e-9 s to 1e9 s. (R0408)")
    return number


def check_wait(value: object) -> Wait:
    """Return how long to wait for other machines: at the start, and until one is back.

    value: for the start alone, or a table for both.
    """
    if isinstance(value, Wait):
        return value
    given = {} if value is None else {"start": value}
    if isinstance(value, Mapping):
        given = {str(word): one for word, one in value.items()}
    for word in given:
        if word not in Wait._fields:
            raise ExperimentError(
                f"wait has {word!r}; expected start or back, such as "
                f'wait={{"back": "30 s"}}.{nearest(word, Wait._fields)} (R0408)'
            )
    one = {word: seconds(value, f"wait: {word}") for word, value in given.items()}
    return Wait(**one)


def check_choice(value: object, what: str, choices: tuple[str, ...]) -> str:
    """Return `value` if it is one of the choices."""
    if isinstance(value, str) and value in choices:
        return value
    expected = " or ".join(f'"{c}"' for c in choices)
    hint = nearest(value, choices)
    raise ExperimentError(f"{what} is {value!r}; expected {expected}.{hint} (R0408)")


def check_common(
    key: str, words: dict[str, Any], dt: float, folder: Path
) -> dict[str, Any]:
    """Take the words of every agent out of `words`, and return them as a plan has them.

    key: of the agent, whose process has this name by default. dt: s.
    """
    since, often = (
        words.pop("since", 0.0),
        "how often it is started again after a crash",
    )
    host, machine = words.pop("host", None), words.pop("machine", None)
    tick = 0 if since in (0, "0 s") else round(seconds(since, "since") / dt)
    every, restart = words.pop("every", 1), words.pop("restart", 0)
    return {
        "every": _whole(every, "every", 1, inf, "a whole number from 1"),
        "restart": _whole(restart, "restart", 0, 1000, f"{often}, such as 3"),
        "host": check_name(host, "host") if host else key,
        "machine": check_name(machine, "machine") if machine else "",
        "since": tick + 1,
        "rules": check_rules(words.pop("rules", ()), folder),
    }


def check_seed(value: object) -> int:
    """Return `value` if hosts can take it as a seed."""
    return _whole(value, "seed", 0, 2**63 - 1, "a whole number from 0 to 2**63 - 1")


def _whole(value: object, what: str, low: int, high: float, expected: str) -> int:
    if (
        isinstance(value, bool)
        or not isinstance(value, int)
        or not low <= value <= high
    ):
        raise ExperimentError(f"{what} is {value!r}; expected {expected}. (R0408)")
    return value


def check_mapping(value: object, what: str) -> None:
    if value is not None and not isinstance(value, Mapping):
        example = EXAMPLES.get(what, '{"track": "0.1 m"}')
        raise ExperimentError(
            f"{what} is {value!r:.60}; expected such as {what}={example}. (R0408)"
        )


def stated(
    given: Mapping[str, Any] | Path | str | None,
    classes: Sequence[Any],
    options: Mapping[str, Any] | None,
    folder: Path,
) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return a robot's parameters and options.

    given: parameters, or the name of a file with those that were identified; its noise
    becomes an option of a driver that simulates      classes: definition and driver
    folder: the base of the name. Raises ExperimentError.
    """
    options = options or {}
    if isinstance(given, str | Path):
        parameters, noise = parameters_for(folder / given, classes[0])
        if noise and "noises" in classes[1].options.schema:
            options = {"noises": as_line(noise), **options}
        return parameters, options
    check_mapping(given, "parameters")
    return given or {}, options


def check_sources(sources: Mapping[str, object]) -> None:
    for port, source in sources.items():
        if not isinstance(source, str):
            raise ExperimentError(
                f"{port.partition('/')[0]} is {source!r:.60}; expected the one port "
                "that it reads, such as 'robot/sim/state'. (R0419)"
            )


def check_command(command: object) -> dict[str, str]:
    """Return, by port, the sources of a robot's command: one, or several."""
    if command is None:
        return {}
    if not isinstance(command, list | tuple):
        sources = {"command": command}
    else:
        names = [str(one) for one in command]
        if (
            not names
            or len({*names}) < len(names)
            or any("*" in name for name in names)
        ):
            raise ExperimentError(
                f"command is {command!r:.60}; expected one writer, such as "
                "'input/keys', or several, each named once, such as "
                "['input/base', 'process/arm']. (R0420)"
            )
        sources = {f"command/{one}": one for one in command}
    check_sources(sources)
    return {port: str(source) for port, source in sources.items()}


def count_ticks(duration: float | None, dt: float, ends: Sequence[float]) -> int:
    """Return how many ticks of `dt` s make `duration`, or last until inputs end."""
    if duration is None and not ends:
        raise ExperimentError(
            'this experiment has no duration, such as "10 s", and no input that ends.'
            " (R0411)"
        )
    lasts = max(ends) if duration is None else duration
    ticks = round(lasts / dt)
    if duration is not None and ticks and abs(lasts / dt - ticks) > 1e-6 * ticks:
        less = floor(lasts / dt)
        raise ExperimentError(
            f"duration is {lasts:g} s, which is no multiple of dt = {dt:g} s; expected "
            f"{less * dt:g} s ({less} steps) or {(less + 1) * dt:g} s ({less + 1})."
            " (R0412)"
        )
    if ticks < 1:
        raise ExperimentError(
            f"duration is {lasts:g} s, less than one step of dt = {dt:g} s. (R0412)"
        )
    return ticks


def check_flag(value: object, what: str) -> bool:
    if not isinstance(value, bool):
        raise ExperimentError(f"{what} is {value!r}; expected true or false. (R0408)")
    return value


def check_folder(folder: Path | str) -> Path:
    """Return the full path of a folder; it must be UTF-8, as hosts need it."""
    if not isinstance(folder, str | Path):
        raise ExperimentError(
            f"a folder is text, such as 'runs/lab'; got {folder!r:.60}. (R0414)"
        )
    try:
        path = Path(folder).resolve()
    except OSError as error:
        raise ExperimentError(
            f"cannot find the folder {str(folder)!r}: {error.strerror}. (R0414)"
        ) from None
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ExperimentError(
            f"the name of the folder {str(path)!a} is no UTF-8, in which agents "
            "get their paths; rename it, or go to another one. (R0414)"
        ) from None
    return path


def make_folder(folder: Path | str) -> Path:
    """Make `folder` and return its full path. Raises ExperimentError with the cause."""
    path = check_folder(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        may = error.errno in (errno.EACCES, errno.EPERM, errno.EROFS)
        raise ExperimentError(
            f"cannot make the folder {path}: {error.strerror}."
            f"{' Go to a folder of your own: cd ~' if may else ''} (R0414)"
        ) from None
    return path


#: by name of an experiment's setting, its check
_CHECKS: Mapping[str, Callable[[Any], object]] = {
    "name": lambda value: check_name(value, "the experiment's name"),
    "fabric": lambda value: value and check_name(value, "the fabric's name"),
    "dt": lambda value: seconds(value, "dt"),
    "duration": lambda value: None if value is None else seconds(value, "duration"),
    "pace": check_pace,
    "folder": check_folder,
    "on_failure": lambda value: check_choice(value, "on_failure", ("stop", "drop")),
    "wait": check_wait,
    "seed": check_seed,
    **{word: partial(check_flag, what=word) for word in ("native", "direct", "record")},
}
#: names of settings that are often tried, and what to write instead
MEANT = {
    **dict.fromkeys(("time", "length", "steps"), "duration="),
    **dict.fromkeys(("step", "rate"), "dt="),
    "speed": "pace=",
    "patience": 'wait={"back": "30 s"}',
}


def checked(owner: object, name: str, value: object) -> object:
    """Return the value for a setting of an experiment, in its own form.

    owner: the experiment; a class that extends it may have other attributes. Raises
    ExperimentError for a name that is no setting, and for a wrong value.
    """
    if name in _CHECKS:
        return _CHECKS[name](value)
    cls = type(owner)
    own = (
        name.startswith("_")
        or name == "plans"
        or not cls.__module__.startswith("rems_net.")
    )
    if own and not callable(getattr(cls, name, None)):
        return value
    hint = f" Write {MEANT[name]}." if name in MEANT else nearest(name, _CHECKS)
    raise ExperimentError(
        f"an experiment has no setting {name!r}, so this line would do nothing. Its "
        f"settings are {', '.join(_CHECKS)}.{hint} (R0408)"
    )
