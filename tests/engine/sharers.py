"""Agents that write some fields of a youBot's command."""

from rems_net import In, Input, Out, Process, Schema, Settings, Tick
from rems_net.defdict import angle, boolean, length, percent, velocity
from rems_net.robots.scaler import Scaler
from rems_net.robots.youbot import Youbot, YoubotArm

#: where a base goes; how it turns, nobody says
AHEAD = Schema("ahead", {"linear": {"x": velocity("mm/s")}, "horn": percent()})
REACH = YoubotArm.command.schema.slice("arm/joint/1", "arm/speed")


class Base(Input):
    """Drives a base ahead."""

    value = Out(AHEAD)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"linear/x": 200.0}


class Silent(Input):
    """Says nothing new after tick 2."""

    value = Out(AHEAD)

    def read(self, tick: Tick) -> dict[str, float] | None:
        return {"linear/x": 200.0} if tick.n < 3 else None


class Above(Process):
    """Turns an arm, until tick 2 where it is quiet."""

    options = Settings(quiet=boolean())
    robot = In(Youbot.state)
    value = Out(REACH)

    def step(self, tick: Tick) -> None:
        if tick.n < 3 or not self.options.quiet:
            self.value = {"arm/joint/1": 0.5, "arm/speed": 1.0}


class Fails(Above):
    """Is gone at tick 10."""

    def step(self, tick: Tick) -> None:
        super().step(tick)
        if tick.n == 10:
            raise ValueError("gone")


class Other(Input):
    """Of another robot."""

    value = Out(Schema("other", {"left": length()}))

    def read(self, tick: Tick) -> None:
        return None


class Slip(Input):
    """Of two fields of the base, one misspelt."""

    value = Out(Schema("slip", {"linear/x": velocity(), "linear/yy": velocity()}))

    def read(self, tick: Tick) -> None:
        return None


class Numbered(Input):
    """Of a longer arm: its joint 9 is no misspelt joint of the youBot's."""

    value = Out(
        Schema("numbered", {"arm/joint/1": angle(), "arm/joint/9": angle()}),
    )

    def read(self, tick: Tick) -> None:
        return None


def _arm(name: str) -> Schema:
    return Scaler.command.schema.slice(f"{name}/wrist/3", f"{name}/speed")


class Left(Input):
    """Turns the left wrist, and says nothing new after 1 s."""

    value = Out(_arm("left"))

    def read(self, tick: Tick) -> dict[str, float] | None:
        return {"left/wrist/3": 3.0, "left/speed": 0.05} if tick.t < 1.0 else None


class Right(Input):
    """Turns the right wrist."""

    value = Out(_arm("right"))

    def read(self, tick: Tick) -> dict[str, float]:
        return {"right/wrist/3": 3.0, "right/speed": 0.05}


class WrongUnit(Input):
    """Says where to be, where a robot expects how fast to go."""

    value = Out(Schema("wrong", {"linear": {"y": length()}}))

    def read(self, tick: Tick) -> None:
        return None
