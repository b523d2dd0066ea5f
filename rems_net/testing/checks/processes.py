"""Processes: it runs alone and beside another, twice with the same bytes."""

import csv
import io
import tempfile
from pathlib import Path

import numpy as np

from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.show import Show
from rems_net.defdict import Schema
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event
from rems_net.recordings.csv_file import heading
from rems_net.testing import lines
from rems_net.testing.checks.driving import share_of
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import sweeps

#: s of a step, s of each command, and the largest number of commands.
STEP, EACH, MOST = 0.05, 0.2, 5


class Quiet(Show):
    """A display that shows nothing: errors are raised."""

    def say(self, source: str, event: Event) -> None:
        """Ignore the event."""


def processes(subject: Subject, outcome: Outcome) -> None:
    """Run it as experiments do, and compare the recordings."""
    robots = ("own",) if subject.driven else ("own", "one", "other")
    found: list[dict[str, bytes]] = []
    for _ in range(1 if subject.driven else 2):
        with tempfile.TemporaryDirectory() as folder:
            try:
                found.append(_run(subject, robots, Path(folder)))
            except (AgentError, ExperimentError) as error:
                outcome.wrong(
                    expected="a run of a second in a process of its own, and of two in "
                    "one process",
                    came=str(error),
                    where=lines.raised(error),
                )
                return
    if subject.driven:
        outcome.remark = "in a process of its own, at the pace of the wall clock"
        return
    robot = subject.make()
    restless = lines.restless(robot)
    first, second = found
    for names, files in {
        "of the first run, and of the second": (first["own"], second["own"]),
        "of one alone, and of one beside another": (first["own"], first["one"]),
        "of two in one process": (first["one"], first["other"]),
    }.items():
        if files[0] != files[1]:
            outcome.wrong(
                expected="the same commands to give the same recording, byte by byte: "
                f"that {names}",
                came=_difference(*files),
                where=restless or lines.method(robot, "drive", "derivative"),
                type=lines.REPEATABLE
                if restless
                else "take all that counts from command, dt and settings",
            )
            return
    outcome.remark = "alone, and two in one; two runs gave the same bytes"


def _run(subject: Subject, robots: tuple[str, ...], folder: Path) -> dict[str, bytes]:
    """Run for some tenths of a second; return the recording of each robot."""
    played, seconds = _played(subject)
    (folder / "played.csv").write_text(played, encoding="utf-8")
    lab = Experiment(
        "check",
        dt=STEP,
        duration=seconds,
        folder=subject.folder,
        pace=1.0 if subject.driven else "fast",
    )
    lab.input("played", "csv", options={"file": str(folder / "played.csv")})
    for name in robots:
        lab.robot(
            name,
            subject.definition,
            subject.driver,
            command="input/played",
            parameters=subject.parameters,
            options=subject.options,
            initial=subject.initial,
            host=None if name == "own" else "both",
        )
    lab.output("log", "csv")
    lab.run(folder / "out", show=Quiet())
    return {name: (folder / "out" / f"{name}.csv").read_bytes() for name in robots}


def _played(subject: Subject) -> tuple[str, float]:
    """Return the commands as the text of a CSV file, and their length in s."""
    schema: Schema = subject.make().schemas()["command"]
    numeric = {p: f for p, f in schema.rows() if f.numeric}
    rows = list(sweeps(schema, share_of(subject)))[-MOST:]
    file = io.StringIO()
    table = csv.writer(file, lineterminator="\n")
    heads, last = ["time [s]"], (len(rows) + 1) * EACH
    for path, field in numeric.items():
        for at in np.ndindex(field.shape):
            element = "".join(f"[{i}]" for i in at)
            heads.append(heading(f"command/{path}{element}", field.unit))
    table.writerow(heads)
    every = [*(values for _, values in rows), schema().flat()]
    for n, values in enumerate(every, 1):
        cells = [np.ravel(values[path]).tolist() for path in numeric]
        table.writerow(
            [f"{n * EACH:g}", *(repr(one) for some in cells for one in some)]
        )
    return file.getvalue(), last


def _difference(one: bytes, other: bytes) -> str:
    """Return the first line in which two recordings differ."""
    pairs = zip(one.splitlines(), other.splitlines(), strict=False)
    for n, (a, b) in enumerate(pairs, 1):
        if a != b:
            heads = one.splitlines()[0].decode().split(",")
            cells = zip(
                heads, a.decode().split(","), b.decode().split(","), strict=False
            )
            head, x, y = next(
                (cell for cell in cells if cell[1] != cell[2]), ("", "", "")
            )
            return f"line {n}: {head} is {x} in one, and {y} in the other"
    return "one is longer than the other"
