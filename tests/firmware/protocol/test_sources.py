"""Who commands it on the fabric: a configured source, and what that says."""

import pytest

from rems_net.agents.clock.clock import Clock
from rems_net.client import Fabric
from rems_net.defdict import Schema, angular_velocity
from rems_net.errors import FabricError
from rems_net.router.mail import Question
from rems_net.router.message import pack, pack_stamp
from tests.agents.runs import until
from tests.firmware.golden import schemas
from tests.firmware.protocol.world import LONG, World, row

SPEEDS = {"left": 2.0, "right": 2.0}


class Input:
    """`input/keys`, as a member puts it: stamped, and asked for its schema."""

    def __init__(self, here: World, clock: Clock, schema: Schema):
        self.session, self.clock, self.schema = here.session(), clock, schema
        self.asked = 0
        key = self.session.key("input", "keys", "@schema")
        self.session.answer_at_once(key, self._tell)
        value = self.session.key("input", "keys", "value")
        self.session.answer_at_once(value, self._answer)
        self._put = self.session.putting(value, f"{schema.name}@{schema.digest}")

    def _tell(self, question: Question) -> None:
        self.asked += 1
        question.answer(question.key, pack({"value": self.schema.to_wire()}))

    def _answer(self, question: Question) -> None:
        key = self.session.key("input", "keys", "value")
        question.answer(key, self._value(), "", self._stamp())

    def _value(self) -> bytes:
        return self.schema({"wheel": SPEEDS}).encode()

    def _stamp(self, run: int = 0) -> bytes:
        tick, run = self.clock.tick, run or self.clock.run_id
        return pack_stamp(tick.n, tick.t, run << 24 | 99)

    def say(self, run: int = 0) -> None:
        self._put(self._value(), attachment=self._stamp(run))


def told(here: World, schema: Schema) -> tuple[Input, Fabric]:
    clock = here.clock()
    here.robot(source="input/keys")
    fabric = here.fabric()
    until(lambda: row(fabric), LONG)
    return Input(here, clock, schema), fabric


def obeys(source: Input, fabric: Fabric) -> bool:
    source.say()
    return bool(fabric.robot("w7").command["wheel/left"] == 2.0)


def why(fabric: Fabric) -> str:
    return "\n".join(fabric.why("robot/w7/command"))


@pytest.mark.parametrize(
    "schema",
    [
        schemas()["command"],
        Schema(
            "keys.value",
            {"wheel": {"left": angular_velocity(), "right": angular_velocity(doc="r")}},
        ),
    ],
    ids=["the same", "without ranges"],
)
def test_it_obeys_its_source(here: World, schema: Schema) -> None:
    source, fabric = told(here, schema)
    until(lambda: obeys(source, fabric), LONG)
    assert source.asked == (schema.digest != schemas()["command"].digest)
    # Nobody else is heard, nor who is of another run.
    command = schemas()["command"]({"wheel/left": 1.0, "wheel/right": 1.0})
    with pytest.raises(FabricError, match="input/keys commands robot/w7, so it takes"):
        fabric.robot("w7").command = command
    fabric.session.put("rems/robot/w7/command", command.encode())
    until(lambda: "is told by input/keys, and by nobody else" in why(fabric), LONG)
    source.say(run=source.clock.run_id ^ 1)
    until(lambda: "stamped by no member of this run" in why(fabric), LONG)
    until(lambda: obeys(source, fabric), LONG)


@pytest.mark.parametrize(
    ("schema", "says"),
    [
        (
            Schema(
                "keys.value",
                {
                    "wheel": {
                        "left": angular_velocity(),
                        "right": angular_velocity(unit="deg/s"),
                    }
                },
            ),
            "whose wheel/right is in deg/s, and robot/w7/command takes",
        ),
        (
            Schema(
                "keys.value",
                {
                    "wheel": {"left": angular_velocity(), "right": angular_velocity()},
                    "arm": angular_velocity(),
                },
            ),
            "whose arm is in rad/s, and robot/w7/command takes",
        ),
    ],
    ids=["another unit", "one more"],
)
def test_what_differs_is_named(here: World, schema: Schema, says: str) -> None:
    source, fabric = told(here, schema)

    def named() -> bool:
        source.say()
        return says in why(fabric)

    until(named, LONG)
    assert fabric.robot("w7").command["wheel/left"] == 0.0
    assert "rems get input/keys" in why(fabric)
    assert source.asked == 1


def test_deaf_to_its_source_it_opens_another_session(here: World) -> None:
    """Its source says in answers what the robot never hears: it reopens its session."""
    clock = here.clock()
    robot = here.robot(source="input/keys")
    fabric = here.fabric()
    until(lambda: row(fabric), LONG)
    source = Input(here, clock, schemas()["command"])
    until(lambda: robot.link.opened > 1, LONG)
    until(lambda: obeys(source, fabric), LONG)
