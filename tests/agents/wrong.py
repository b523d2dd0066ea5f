"""Agents that go wrong, each in one way or in the way it is told."""

import ctypes
import math
import os
import sys
from typing import Any

from rems_net import Input, Out, Schema, Settings, Tick
from rems_net.defdict import length, text
from rems_net.outputs.csv import CsvOutput
from tests.agents.parts import COUNT
from tests.signals import KILL


class Bad(Input):
    """Misbehaves at tick 5, in the way it is told."""

    options = Settings(how=text(default=""))
    value = Out(Schema("bad", {"x": length("m"), "name": text()}))

    def open(self) -> None:
        if self.options.how == "open":
            raise OSError("the stick is not plugged in")
        if self.options.how == "die early":
            os.kill(os.getpid(), KILL)

    def read(self, tick: Tick) -> Any:
        if tick.n != 5:
            return {"x": 0.1, "name": "fine"}
        match self.options.how:
            case "list":
                return [1.0, 2.0]
            case "number":
                return 7
            case "unknown field":
                return {"nmae": "x"}
            case "nan":
                return {"x": float("nan")}
            case "text for a number":
                return {"x": "far"}
            case "second":
                return {"x": "2 s"}
            case "exit":
                sys.exit(3)
            case "os._exit":
                os._exit(7)
            case "segfault":
                ctypes.string_at(0)
            case "recursion":
                return self.read(tick)
            case "job":
                self.jobs.submit(math.sqrt, -1.0)
        return None

    def close(self) -> None:
        if self.options.how == "close":
            raise OSError("the stick is stuck")


class Constructed(Input):
    """Can be made by who starts the experiment, but not in its own process."""

    value = Out(COUNT)

    def __init__(self, *args: Any, **settings: Any):
        super().__init__(*args, **settings)
        if os.environ.get("PARTS_PARENT") != str(os.getpid()):
            raise ValueError("no two sticks are alike")

    def read(self, tick: Tick) -> None:
        raise AssertionError("it is never made")


class Full(CsvOutput):
    """Its disk is full after some kilobytes."""

    def open(self) -> None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
        super().open()
