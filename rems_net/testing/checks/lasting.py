"""Lasting: it opens, closes in every situation, and opens again."""

import threading
import time

from rems_net.testing import lines
from rems_net.testing.bench import bench
from rems_net.testing.checks.driving import share_of
from rems_net.testing.leaks import leaks
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import differs, medley

#: s. Time that a thread may take to end.
ENDS = 1.0


def opens(subject: Subject, outcome: Outcome) -> None:
    """Open it, and measure how long that takes."""
    begun = time.perf_counter()
    with subject.opened():
        outcome.remark = f"in {(time.perf_counter() - begun) * 1e3:.1f} ms"


def closes(subject: Subject, outcome: Outcome) -> None:
    """Close it twice after a drive, and close one that was never opened."""
    threads = set(threading.enumerate())
    with leaks() as left:
        _use(subject)
    begun = [one for one in threading.enumerate() if one not in threads]
    end = time.monotonic() + ENDS
    for one in begun:
        one.join(max(0.0, end - time.monotonic()))
    lives = [f"a thread, {one.name}" for one in begun if one.is_alive()]
    if lives or left:
        robot = subject.make()
        outcome.wrong(
            expected="close() to give back all that open() acquired",
            came=f"this is left: {', '.join([*lives, *left])}",
            where=lines.method(robot, "close", "disconnect", "open"),
            type="def close(self):\n    self.file.close()  # what open() acquired\n"
            "    super().close()",
        )
    outcome.remark = "twice, and without having been opened"


def _use(subject: Subject) -> None:
    """Use it here alone, so that no reference to it is left afterwards."""
    robot = subject.make()
    robot.open()
    try:
        bench(robot).run(medley(robot, share_of(subject)), 0.2)
    finally:
        robot.close()
    robot.close()
    subject.make("never_opened").close()


def again(subject: Subject, outcome: Outcome) -> None:
    """Open a second one after the first, in one process, as tests and notebooks do."""
    paths = []
    for name in ("first", "second"):
        with subject.opened(name) as robot:
            values = medley(robot, share_of(subject))
            paths.append(bench(robot).run(values, 0.4))
    outcome.remark = "opened and closed, twice in a row"
    if subject.driven:
        return
    outcome.remark += ": the same to the last bit"
    schema = robot.schemas()["state"]
    for first, second in zip(*paths, strict=True):
        field, far = differs(schema, first, second)
        if far:
            restless = lines.restless(robot)
            attribute, text = lines.shared(robot)
            outcome.wrong(
                expected="the second robot to do what the first one did, to the last "
                "bit: what it does follows from its settings and commands alone",
                came=f"{field} differs by {far:.3g}",
                where=restless
                or (attribute and f"{attribute} = {text}, which all of them share")
                or lines.method(robot, "drive", "derivative"),
                type=lines.REPEATABLE
                if restless
                else "keep in self what changes: def open(self): self.x = ...",
            )
            return
