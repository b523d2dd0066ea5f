"""What the tests of driven robots share: the device's process, and what it noted."""

import json
import subprocess
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Self

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.driven import Driven
from tests.agents.runs import until
from tests.drivers import alone
from tests.drivers.hardware.parts import Cart, SerialCart

DEVICE = Path(__file__).parent / "device.py"


class Device:
    """The firmware's process. `with Device(folder) as device:`."""

    def __init__(self, folder: Path, watchdog: float = 60.0):
        self.link, self.path = folder / "ttyCart", folder / "device.log"
        self.watchdog = watchdog

    def __enter__(self) -> Self:
        pytest.importorskip("pty", reason="there are no pseudo-terminals here")
        pytest.importorskip("serial", reason="pyserial is not installed")
        command = [sys.executable, str(DEVICE), str(self.link), str(self.path)]
        self.process = subprocess.Popen(
            [*command, "--watchdog", str(self.watchdog)],
            stdin=subprocess.PIPE,
            text=True,
        )
        until(self.link.exists)
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(20) == 0, "the device failed"
        broken = [note for note in self.notes() if "broken" in note]
        assert not broken, broken

    def tell(self, words: str) -> float:
        """Have it misbehave; the time at which it began to."""
        before = len(self.notes())
        assert self.process.stdin is not None
        print(words, file=self.process.stdin, flush=True)
        return float(
            until(lambda: [n for n in self.notes()[before:] if "told" in n])[0]["t"]
        )

    def notes(self) -> list[dict[str, Any]]:
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
        return [json.loads(line) for line in lines if line.endswith("\n")]

    def heard(self, since: float = 0.0) -> list[dict[str, Any]]:
        return [n for n in self.notes() if "heard" in n and n["t"] >= since]

    @property
    def speed(self) -> float | None:
        """What it was told last."""
        heard = self.heard()
        return float(heard[-1]["heard"][0]) if heard else None


def opened(
    device: Device, driver: type[Driven] = SerialCart, **options: Any
) -> AbstractContextManager[Any]:
    """A cart outside of a host, opened; closed at the end."""
    both = {"port": str(device.link)} | options
    return alone.opened(combine(Cart, driver)("b", options=both))


def drive(robot: Any, seconds: float, speed: float = 0.5, every: float = 0.02) -> None:
    """Tell it so again and again, as a host would, for `seconds`."""
    alone.keep_for(robot, {"speed": speed, "turn": 0.0}, seconds, every)
