"""Cells: every definition with every driver that can move it."""

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

#: The name of the column for drivers of hardware.
HARDWARE = "hardware"
#: The driver of robots that run on another computer.
ELSEWHERE = BUILT_IN["driver"]["remote"]


@dataclass(slots=True)
class Cell:
    """One definition with one driver.

    subject: the robot that can run here; None if it cannot, then `why` is the reason.
    missing: whether the reason is a library, which another computer may have.
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
        """Whether it runs in wall time; here, with its emulator."""
        return self.subject is not None and self.subject.driven

    def running(self) -> AbstractContextManager[Subject]:
        """Return a context with the robot, and an emulated device if it needs one."""
        assert self.subject is not None
        if self.driven:
            return emulated(self.subject, self.driver)
        return nullcontext(self.subject)


def cells(only: Sequence[str] = ()) -> Iterator[Cell]:
    """Return every cell, definition by definition; or only those of the parts in
    `only`.

    A name of both kinds, such as create2, is taken as the definition.

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
                f"{', '.join(names)}.{nearest(name, names)} (R0425)"
            )
    moved = [d for d, part in definitions.items() if _obeys(part)]
    rows = [d for d in definitions if d in only] or moved
    columns = [d for d in drivers if d in only and d not in rows] or list(drivers)
    for row in rows:
        for column in columns:
            yield _cell(definitions[row], drivers[column])


def _obeys(definition: parts.Part) -> bool:
    """Return whether a definition is of a robot that moves; a camera's is not."""
    try:
        return bool(getattr(definition.load(), "obeys", True))
    except RemsError:  # its cells have the reason
        return True


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
    """Return whether there is an emulator of that robot for this driver.

    A driver has the name of its robot; after a `-` comes what distinguishes several. A
    part of a robot, such as `scaler_left`, is moved by the devices of the whole one.
    """
    whole = definition.partition("_")[0]
    return driver in known.KNOWN and driver.partition("-")[0] == whole


@contextmanager
def emulated(subject: Subject, driver: str) -> Iterator[Subject]:
    """Yield the robot, configured for an emulated device that the block runs."""
    serial = "port" in subject.driver.options.schema.paths
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "device") if serial else "0"
        with known.emulated(driver, path) as device:
            told = {"port" if serial else "url": device.where}
            yield replace(subject, options={**subject.options, **told})
