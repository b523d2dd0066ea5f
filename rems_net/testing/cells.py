"""Cells: every definition with every driver that can do it, found among the parts."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from rems_net.agents import parts
from rems_net.agents.registry import BUILT_IN
from rems_net.agents.robot import Definition, Driver
from rems_net.emulators import known
from rems_net.errors import ExperimentError, MissingPartError, RemsError, nearest
from rems_net.testing.subject import Subject

#: the column of all that is really driven
HARDWARE = "hardware"
#: robots that are elsewhere
ELSEWHERE = BUILT_IN["driver"]["remote"]


@dataclass(slots=True)
class Cell:
    """One definition with one driver.

    subject: what can be run here; else `why` says why it cannot.
    missing: whether that is a library, which another machine may have.
    """

    definition: str
    driver: str
    subject: Subject | None = None
    why: str = ""
    missing: bool = False

    @property
    def name(self) -> str:
        """`woodbot mujoco`, as `rems check` takes it."""
        return f"{self.definition} {self.driver}"

    @property
    def driven(self) -> bool:
        """Whether it lives in wall time; here, by its emulator."""
        return self.subject is not None and self.subject.driven

    def running(self) -> AbstractContextManager[Subject]:
        """The robot; with its device beside it, emulated, where it needs one."""
        assert self.subject is not None
        if self.driven:
            return emulated(self.subject, self.driver)
        return nullcontext(self.subject)


def cells(only: Sequence[str] = ()) -> Iterator[Cell]:
    """Every cell, definition by definition; or those of these parts only.

    A name that both have, such as create2, is that of the definition.

    Raises ExperimentError for a name that no part has.
    """
    definitions = {n: some[0] for n, some in parts.by_name("definition").items()}
    drivers = {n: some[0] for n, some in parts.by_name("driver").items()}
    drivers = {n: part for n, part in drivers.items() if part.reference != ELSEWHERE}
    for name in only:
        if name not in definitions and name not in drivers:
            names = [*(definitions | drivers)]
            raise ExperimentError(
                f"There is no definition and no driver {name!r}; there is "
                f"{', '.join(names)}.{nearest(name, names)}"
            )
    rows = [d for d in definitions if d in only] or list(definitions)
    columns = [d for d in drivers if d in only and d not in rows] or list(drivers)
    for row in rows:
        for column in columns:
            yield _cell(definitions[row], drivers[column])


def _cell(definition: parts.Part, driver: parts.Part) -> Cell:
    cell = Cell(definition.name, driver.name)
    try:
        found, done = definition.load(), driver.load()
        assert issubclass(found, Definition)
        assert issubclass(done, Driver)
        subject = Subject(found, done)
        if subject.driven:
            if not is_emulated(definition.name, driver.name):
                cell.why = "there is no emulator for it"
                return cell
        else:
            subject.make()
        cell.subject = subject
    except RemsError as error:
        cell.why = str(error).splitlines()[0]
        cell.missing = isinstance(error, MissingPartError)
    return cell


def is_emulated(definition: str, driver: str) -> bool:
    """Whether there is an emulator of that robot, as this driver drives it.

    Both are called as the robot is, with what tells several apart behind a `-`. A part
    of a robot, `scaler_left`, is moved by devices of the whole one.
    """
    whole = definition.partition("_")[0]
    return driver in known.KNOWN and driver.partition("-")[0] == whole


@contextmanager
def emulated(subject: Subject, driver: str) -> Iterator[Subject]:
    """The robot, told where its emulated device is, for as long as the block."""
    serial = "port" in subject.driver.options.schema.paths
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "device") if serial else "0"
        with known.emulated(driver, path) as device:
            told = {"port" if serial else "url": device.where}
            yield replace(subject, options={**subject.options, **told})
