"""Store: the folder of a sweep, into which only it and its own workers write.

A run appears in it as a whole, by the new name of its folder. So a sweep that was
killed at any moment goes on with the runs that are not there.
"""

import json
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from rems_net.agents.experiment.checking.settings import check_folder, make_folder
from rems_net.agents.experiment.folder import move_away
from rems_net.errors import ExperimentError, shown
from rems_net.events import info
from rems_net.recordings.recording import SWEEP
from rems_net.sweeps.work import Made, Row
from rems_net.system.patience import patiently
from rems_net.system.reading import TABLE, read_file

#: the row of a run, in its folder
ROW = "row.json"
CSV, PARQUET = "table.csv", "table.parquet"
#: begins the name of a folder that is being written
PART = ".part-"


class Store:
    """Folder of a sweep.

    runs: of the sweep, which a name has digits for.
    """

    def __init__(self, path: Path, runs: int):
        self.path, self.runs = check_folder(path), runs
        self._digits = max(3, len(str(runs)))

    def begin(self, what: str) -> list[Row]:
        """Make the folder of this sweep, or go on with it: return its rows.

        what: the whole sweep, as text. Another sweep there is moved away. Raises
        ExperimentError for a folder with other files.
        """
        file = self.path / SWEEP
        before = self._read(file)
        if before is not None and before != what:
            text = move_away(self.path, (), whole=True)
            info("moved", f"{text}: it was another sweep")
        elif before is None and self.path.is_dir() and any(self.path.iterdir()):
            raise ExperimentError(
                f"{shown(self.path)} has files in it that are of no sweep; name another"
                " folder: rems sweep --out DIR. (R1026)"
            )
        make_folder(self.path)
        if before != what:
            self._put(file, what.encode(), "the description of the sweep")
        self.tidy()
        return [*self._rows()]

    def tidy(self) -> None:
        """Remove the parts of runs that were not made to their end."""
        for left in self.path.glob(f"{PART}*"):
            if left.is_dir():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)

    def part(self, number: int) -> Path:
        """Return the folder of a run that is not over."""
        return self.path.resolve() / f"{PART}{number}"

    def folder(self, number: int) -> Path:
        """Return the folder of a run."""
        return self.path / f"{number:0{self._digits}}"

    def add(self, made: Made) -> None:
        """Write a run. Raises ExperimentError, and leaves no part of it."""
        number = made.row.number
        part = self.part(number)
        try:
            part.mkdir(exist_ok=True)
            for name, data in made.files.items():
                if "/" in name:
                    (part / name).parent.mkdir(parents=True, exist_ok=True)
                (part / name).write_bytes(data)
            (part / ROW).write_text(json.dumps(made.row) + "\n", encoding="utf-8")
            patiently(lambda: part.rename(self.folder(number)))
        except OSError as error:
            shutil.rmtree(part, ignore_errors=True)
            raise self._full(f"run {number} of {self.runs}", error) from None

    def tables(self, csv: bytes) -> None:
        """Write the table of the rows that are there. Raises ExperimentError."""
        self._put(self.path / CSV, csv, CSV)

    def _put(self, file: Path, data: bytes, what: str) -> None:
        part = self.path / f"{PART}{file.name}"
        try:
            part.write_bytes(data)
            patiently(lambda: part.replace(file))
        except OSError as error:
            with suppress(OSError):
                part.unlink()
            raise self._full(what, error) from None

    def _full(self, what: str, error: OSError) -> ExperimentError:
        return ExperimentError(
            f"cannot write {what} into {shown(self.path)}: {error.strerror}. Make room "
            "there, or close what has it open, and type the same command again: it "
            "goes on with this run. (R1025)"
        )

    def _rows(self) -> Iterable[Row]:
        for number in range(1, self.runs + 1):
            text = self._read(self.folder(number) / ROW)
            if text is not None:
                number, status, ticks, values, error = json.loads(text)
                yield Row(number, status, ticks, [(v, u) for v, u in values], error)

    def _read(self, file: Path) -> str | None:
        try:
            return read_file(file, TABLE).decode()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise ExperimentError(
                f"cannot read {shown(file)}: {error.strerror}. (R1026)"
            ) from None
