"""A user's experiment: a file, or a script, run as `python script.py` would run it."""

import runpy
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.file import load, located
from rems_net.errors import (
    AgentError,
    ExperimentError,
    FabricError,
    RemsError,
    whereabouts,
)


def run_experiment(path: Path, words: Sequence[str], runner: registry.Runner) -> None:
    """Run the experiment in a file, or a script with `words` as its arguments.

    runner: runs each experiment. Raises ExperimentError with the place in the file.
    """
    if path.suffix == ".py":
        run_script(path, words, runner)
        return
    if words:
        raise ExperimentError(
            f"{path} takes no arguments of its own, but got "
            f"{' '.join(words)!r} after '--'; only a script (.py) does. (R0904)"
        )
    experiment = load(path)
    try:
        runner(experiment)
    except (AgentError, FabricError):
        raise
    except RemsError as error:
        with located(path):
            raise error


def run_script(path: Path, words: Sequence[str], runner: registry.Runner) -> None:
    """Run a script with `words` as its arguments; `runner` runs its experiments.

    Raises ExperimentError for a script that cannot be run, that runs no experiment, or
    that fails; the message names the line.
    """
    runs = 0

    def count(*args: object, **more: object) -> object:
        nonlocal runs
        runs += 1
        return runner(*args, **more)

    with registry.running_by(count), _in_its_place(path, words), _lines_named(path):
        made = runpy.run_path(str(path.absolute()), run_name="__main__")
    if not runs:
        raise _no_run(path, made)


@contextmanager
def _in_its_place(path: Path, words: Sequence[str]) -> Iterator[None]:
    """Give the script its arguments, and its folder to import from."""
    if not path.is_file():
        raise ExperimentError(f"There is no file {whereabouts(path, '.py')} (R0401)")
    before = sys.argv[:], sys.path[:]
    sys.argv[:] = [str(path), *words]
    sys.path.insert(0, str(path.resolve().parent))
    try:
        yield
    finally:
        sys.argv[:], sys.path[:] = before


@contextmanager
def _lines_named(path: Path) -> Iterator[None]:
    """Begin an error with the script and the line that it comes from."""
    try:
        yield
    except AgentError:
        raise
    except RemsError as error:
        raise ExperimentError(f"{place(path, error)}: {error}") from None
    except Exception as error:
        raise registry.failure(error) from error


def place(path: Path, error: BaseException) -> str:
    """Return `weave.py, line 12`: the script's innermost line that led to the error."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if f.filename == str(path.absolute())]
    return f"{path}, line {lines[-1]}" if lines else str(path)


def _no_run(path: Path, made: dict[str, object]) -> ExperimentError:
    """Return the error for a script that ended without a run."""
    for name, value in made.items():
        if isinstance(value, Experiment):
            return ExperimentError(
                f"{path} makes an experiment and does not run it; write {name}.run() "
                "at its end. (R0450)"
            )
    return ExperimentError(
        f"{path} runs no experiment; expected a script that ends with the run() of "
        "one. Type `rems new robot my_robot` to see such a script. (R0450)"
    )
