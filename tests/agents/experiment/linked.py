"""Agents that hear themselves, and agents whose Ins have no schema of their own."""

from rems_net import In, Out, Output, Process, Schema, Tick
from rems_net.defdict import integer, length

COUNT = Schema("count", {"n": integer()})


class Sum(Process):
    """Adds one to what it said in the step before."""

    before = In(COUNT)
    value = Out(COUNT)

    def step(self, tick: Tick) -> None:
        self.value = {"n": self.before.n + 1}


class Again(Process):
    """The same, with the schema of whatever it is connected to."""

    before = In(source="process/again/value")
    value = Out(COUNT)

    def step(self, tick: Tick) -> None:
        self.value = {"n": self.before["n"] + 1}


class Far(Process):
    """Says in which unit it hears one field of the one that it reads."""

    where = In()
    value = Out(Schema("far", {"x": length("cm")}))

    def step(self, tick: Tick) -> None:
        unit = self.where.describe()["x"]["unit"]
        self.value["x"] = f"{self.where.x} {unit}"
        if tick.n == 3:
            print(type(self.where).__name__, unit, flush=True)


class Lines(Output):
    """Writes what every process said."""

    all = In(source="process/*/*")

    def open(self) -> None:
        self.file = (self.out / "lines.txt").open("w", encoding="utf-8")

    def write(self, tick: Tick) -> None:
        for key, value in self.all.items():
            print(tick.n, key, *value.values(), file=self.file, flush=True)

    def close(self) -> None:
        self.file.close()


class Neighbours(Process):
    """Counts the others."""

    others = In(source="process/*/value")
    value = Out(COUNT)

    def step(self, tick: Tick) -> None:
        self.value = {"n": len(self.others)}
