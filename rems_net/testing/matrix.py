"""Matrix: how well each cell agrees with its mathematics, and how fast it is."""

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

from rems_net.agents.diagnosis import describe
from rems_net.drivers.hardware.driven import Driven
from rems_net.errors import FabricError, MissingPartError
from rems_net.testing.agreement import Agreement, measure
from rems_net.testing.bench import Bench, WallBench
from rems_net.testing.cells import Cell
from rems_net.testing.subject import Subject
from rems_net.testing.values import SLOW, medley

#: s. Length of a step: the default of experiments.
STEP = 0.1
#: s of wall time of a measurement, and how many; the fastest counts.
PORTION, PORTIONS = 0.1, 3
#: s of wall time for which a driven robot is measured.
WATCHED = 1.0


@dataclass(frozen=True, slots=True)
class Measured:
    """Results of one cell.

    agreement: None if there is no model to compare with.  steps: of 0.1 s, per second
    of wall time; of a driven robot, exchanges per second.

    problem: what went wrong; if set, the other values do not count.
    """

    cell: Cell
    agreement: Agreement | None = None
    steps: float = 0.0
    problem: str = ""

    @property
    def ok(self) -> bool:
        """Whether it is within what its definition allows."""
        off = self.agreement
        return not self.problem and (off is None or off.error <= off.allowed)

    def to_plain(self) -> dict[str, Any]:
        """Return it as plain values for JSON."""
        cell = self.cell
        return {
            "definition": cell.definition,
            "driver": cell.driver,
            "driven": cell.driven,
            "runs": cell.subject is not None,
            "why": cell.why,
            "ok": self.ok,
            "problem": self.problem,
            "steps_per_second": self.steps,
            "agreement": asdict(self.agreement) if self.agreement else None,
        }


def measured(cell: Cell) -> Measured:
    """Measure a cell, for some seconds; one that cannot run gives empty results."""
    if cell.subject is None:
        return Measured(cell)
    try:
        with cell.running() as subject:
            found, _ = measure(subject)
            return Measured(cell, found, speed(subject))
    except (MissingPartError, FabricError) as error:
        # A library is missing, or the pseudo-terminals for an emulated device.
        return Measured(replace(cell, subject=None, why=str(error), missing=True))
    except Exception as error:
        # Any error of one cell: the other cells of the table are still measured.
        return Measured(cell, problem=describe(error))


def speed(subject: Subject) -> float:
    """Return the steps of 0.1 s per second of wall time, with commands and sensors.

    The robot runs in this process. For a driven robot, return exchanges per second.
    """
    with subject.opened() as robot:
        values = medley(robot, SLOW)
        if isinstance(robot, Driven):
            where: Bench = WallBench(robot)
            before, begun = robot.figures()["cycles"], time.perf_counter()
            where.run(values, WATCHED)
            cycles = robot.figures()["cycles"] - before
            return float(cycles / (time.perf_counter() - begun))
        where = Bench(robot, STEP)
        where.step(values)
        best = 0.0
        for _ in range(PORTIONS):
            robot.reset()
            count, begun = 0, time.perf_counter()
            while (lasted := time.perf_counter() - begun) < PORTION:
                where.step(values)
                count += 1
            best = max(best, count / lasted)
        return best
