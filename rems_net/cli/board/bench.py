"""Bench: measures a Woodbot that drives, and records each of its drives."""

import math
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from csv import writer
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.agents import parts
from rems_net.agents.experiment.folder import move_away
from rems_net.agents.robot import Definition
from rems_net.client import Proxy
from rems_net.errors import AgentError, ExperimentError, uncoded
from rems_net.firmware.calibration import Servo
from rems_net.recordings.csv_file import heading

SIDES = ("left", "right")
#: s. Interval of commands and of readings, which are as often as the lidar's.
PERIOD = 0.033
#: s. Longest wait until the robot stands.
STANDSTILL_TIMEOUT = 5.0
#: s. Time until a robot that was stopped stands.
ROLL_OUT = 0.6
#: m. Nearest and farthest wall that the lidar measures well.
NEAR, FAR = 0.2, 1.1


class Sample(NamedTuple):
    """Values of a robot that drives. time: s, monotonic."""

    time: float
    command: Mapping[str, float]
    state: Mapping[str, float]
    sensors: Mapping[str, float]


class Bench:
    """A robot that this program alone drives, with all samples of it."""

    def __init__(self, name: str, robot: Proxy):
        self.name, self.robot = name, robot
        woodbot = parts.find("definition", "woodbot", Path())(name)
        assert isinstance(woodbot, Definition)  # `find` has checked it
        woodbot.prepare()
        self.woodbot, self.parameters = woodbot, woodbot.parameters
        self.samples: list[Sample] = []

    def servos(self) -> dict[str, Servo]:
        """Return the stored values. Raises ExperimentError if it has no servos."""
        try:
            told = self.robot.servos()
        except AgentError as error:
            raise ExperimentError(
                f"robot/{self.name} has no servos to calibrate, only a Woodbot with "
                f"its own firmware has. ({uncoded(error)}) (R0712)"
            ) from None
        return {
            side: Servo(
                float(told[f"{side}_trim"]),
                float(told[f"{side}_dead_band"]),
                float(told[f"{side}_top_speed"]),
                told[f"{side}_reversed"] == "yes",
            )
            for side in SIDES
        }

    def store(self, servos: Mapping[str, Servo]) -> None:
        """Stop the robot, and store the values of its servos."""
        self.stand()
        words = {}
        for side, one in servos.items():
            words[f"{side}_trim"] = f"{one.trim:.1f}"
            words[f"{side}_dead_band"] = f"{one.dead_band:.1f}"
            words[f"{side}_top_speed"] = f"{one.top_speed:.3f}"
        self.robot.servos(**words)

    def check(self, *, lidar: bool) -> None:
        """Raise ExperimentError if a part is absent, or STOP holds."""
        figures = self.robot.figures()
        needed = {"gyro/z", "lidar/front"} if lidar else {"gyro/z"}
        for part in sorted(needed.intersection(figures["absent"])):
            hint = " Use --ruler" if part == "lidar/front" else " Look at its plug"
            raise ExperimentError(
                f"robot/{self.name} reports that {part} is absent.{hint} (R0712)"
            )
        if figures["safe"] == "stopped":
            raise ExperimentError("STOP holds. Type: rems stop --release (R0712)")

    def drive(self, left: float, right: float, seconds: float) -> list[Sample]:
        """Drive for some seconds, at these speeds of the wheels [rad/s]."""
        command = {"wheel/left": left, "wheel/right": right}
        first = len(self.samples)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if left or right:
                self.robot.command = command
            state, sensors = self.robot.state.get(), self.robot.sensors.get()
            sample = Sample(time.monotonic(), command, state.flat(), sensors.flat())
            self.samples.append(sample)
            time.sleep(PERIOD)
        return self.samples[first:]

    def stand(self) -> None:
        """Stop the robot, and wait until nobody drives it."""
        if not self.robot.figures()["safe"]:
            self.robot.command = {"wheel/left": 0.0, "wheel/right": 0.0}
        until = time.monotonic() + STANDSTILL_TIMEOUT
        while not self.robot.figures()["safe"]:
            if time.monotonic() > until:
                raise ExperimentError(
                    f"Another program commands robot/{self.name}. Type: rems why "
                    f"robot/{self.name}/command (R0712)"
                )
            time.sleep(PERIOD)

    def go(self, speed: float, way: float) -> float:
        """Drive straight; return the distance that the robot estimates [m].

        speed: rad/s of both wheels      way: m, negative for back
        """
        speed = math.copysign(speed, way)
        before = self.robot.state.get()
        self.drive(speed, speed, abs(way / (self.parameters.wheel_radius * speed)))
        self.stand()
        after = self.robot.state.get()
        return math.hypot(after["x"] - before["x"], after["y"] - before["y"])

    def turn(self, speed: float, angle: float, bias: float) -> tuple[float, float]:
        """Turn on the spot; return the angles of its gyroscope and by its estimate.

        speed: rad/s of the wheels      angle: rad, about      bias: rad/s, at rest
        """
        p = self.parameters
        before = self.robot.state.get()["heading"]
        seconds = angle * p.track / (2 * p.wheel_radius * speed)
        samples = self.drive(-speed, speed, seconds)
        self.robot.command = {"wheel/left": 0.0, "wheel/right": 0.0}
        samples = samples + self.drive(0, 0, ROLL_OUT)
        self.stand()
        turned = 0.0
        for one, then in pairwise(samples):
            rate = (one.sensors["gyro/z"] + then.sensors["gyro/z"]) / 2 - bias
            turned += rate * (then.time - one.time)
        return turned, float(self.robot.state.get()["heading"]) - before

    def wall(self, seconds: float) -> float:
        """Return the distance of the wall ahead [m], the mean of some seconds."""
        seen = mean(self.drive(0, 0, seconds), "lidar/front")
        if not NEAR <= seen <= FAR:
            raise ExperimentError(
                f"robot/{self.name} is {seen:.2f} m from what is ahead; put it 0.4 to "
                "1 m from a wall, facing it. Without a wall: --ruler (R0712)"
            )
        return seen

    @contextmanager
    def recording(self, folder: Path) -> Iterator[Path]:
        """Write all samples into a CSV file in the end, also after an error."""
        path = folder / f"{self.name}.csv"
        try:
            yield path
        finally:
            if self.samples:
                if folder.exists():
                    move_away(folder, (), whole=True)
                folder.mkdir(parents=True)
                with path.open("w", newline="", encoding="utf-8") as file:
                    writer(file, lineterminator="\n").writerows(self._rows())

    def _rows(self) -> Iterator[list[Any]]:
        ports = ("command", "state", "sensors")
        fields = [
            (port, *row)
            for port in ports
            for row in self.woodbot.schemas()[port].rows()
        ]
        names = [heading(f"{port}/{path}", one.unit) for port, path, one in fields]
        yield ["time [s]", *names]
        start = self.samples[0].time
        for one in self.samples:
            values = [getattr(one, port)[path] for port, path, _ in fields]
            yield [round(one.time - start, 6), *values]


def mean(samples: list[Sample], sensor: str) -> float:
    """Return the mean of a sensor."""
    return math.fsum(one.sensors[sensor] for one in samples) / len(samples)
