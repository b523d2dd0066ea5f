"""Building: the constructor only stores, and wrong settings are refused."""

import threading
from math import inf

from rems_net.agents.robot import Robot
from rems_net.errors import RemsError, SchemaError
from rems_net.testing import lines
from rems_net.testing.leaks import leaks
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import beyond

#: A setting that no robot has.
WRONG = "no_such_setting"


def built(subject: Subject, outcome: Outcome) -> None:
    """Build two robots; check that nothing is acquired yet, and describe the ports."""
    threads = set(threading.enumerate())
    with leaks() as left:
        subject.make()
        subject.make("other")
    robot = subject.make()
    begun = [one.name for one in threading.enumerate() if one not in threads]
    if begun or left:
        outcome.wrong(
            expected="a constructor and a prepare() that store and check, no more: "
            "they run where the experiment is started, too, and nobody closes that one",
            came=f"they begin {', '.join([*begun, *left])}",
            where=lines.method(robot, "__init__", "prepare"),
            type="def open(self):  # acquire it here, and give it back in close(self)",
        )
    if not 0 < robot.max_age < inf:
        raise SchemaError(
            f"max_age = {robot.max_age!r}; expected the seconds that a command lives, "
            "more than 0, and some day an end, since a robot stops by itself. Write: "
            "max_age = 0.5 (R0912)"
        )
    _describe(robot, outcome)


def _describe(robot: Robot, outcome: Outcome) -> None:
    schemas = robot.schemas()
    command = schemas["command"]
    free = [p for p, f in command.rows() if f.dtype == "float" and f.range is None]
    if free:
        outcome.notes.append(
            f"nothing refuses {free[0]} = 1e9: a field of the command has a range, "
            f"such as {free[0].rpartition('/')[2]}=velocity(range=(-1, 1))."
        )
    counts = (f"{len(s.paths)} of {port}" for port, s in schemas.items())
    outcome.remark = f"fields: {', '.join(counts)}"


def refuses(subject: Subject, outcome: Outcome) -> None:
    """Set wrong commands and settings, and check that each is refused."""
    robot = subject.make()
    schema = robot.schemas()["command"]
    count = 0
    for path, value, why in beyond(schema):
        count += 1
        robot.__dict__["command"] = schema()
        try:
            robot.command = {path: value}
        except (RemsError, TypeError):
            kept = robot.__dict__["command"]
            if kept == schema():
                continue
            came = f"it was refused, and the command is {kept} now"
        else:
            came = f"{path} = {value!r} was taken"
        outcome.wrong(
            expected=f"command {path} = {value!r} to be refused: {why}",
            came=came,
            where=lines.method(robot, "command", "prepare", "__init__"),
            type="command = In(Schema(...))  # a port checks its values by itself",
        )
    for slot in ("parameters", "options", "initial"):
        count += 1
        try:
            subject.make("wrong", **{slot: {WRONG: 1.0}})
        except RemsError:
            continue
        outcome.wrong(
            expected=f"{slot} = {{{WRONG!r}: 1.0}} to be refused: a slip of the hand "
            "would else be a robot with other settings than the student thinks",
            came="it was taken without an error",
            where=lines.method(robot, "__init__", "prepare"),
            type=_INIT,
        )
    if subject.driven:
        count += _port(subject, outcome)
    outcome.remark = f"{count} wrong commands and settings"


_INIT = """\
leave __init__ out, or pass on what it is given:
def __init__(self, name="", **rest):
    super().__init__(name, **rest)"""
#: A port that no computer has.
NOWHERE = "/dev/no-such-port"


def _port(subject: Subject, outcome: Outcome) -> int:
    """Open a port that has no device; return how many checks that was."""
    if "port" not in subject.driver.options.schema.paths:
        return 0
    robot = subject.make("nowhere", options={"port": NOWHERE})
    try:
        robot.open()
    except RemsError:
        return 1
    finally:
        robot.close()
    outcome.wrong(
        expected=f"open() to refuse port = {NOWHERE!r}, where there is no device",
        came="it opened",
        where=lines.method(robot, "connect", "open"),
        type="let connect(self) raise OSError where there is no device",
    )
    return 1
