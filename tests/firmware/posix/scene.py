"""Scene: an open fabric, a Woodbot as a process on it, and who drives it."""

import socket
import time
from pathlib import Path

from tests.agents.runs import free_port
from tests.firmware.posix.driver import Driver
from tests.firmware.posix.robot import Robot
from tests.firmware.posix.valve import Valve
from tests.reliability.rig.programs import Program, until
from tests.reliability.rig.rig import Rig

NAME = "woodbot-7"


class Scene:
    """`serve` first; then `start` a robot, and `drive` it."""

    def __init__(self, rig: Rig, program: Path):
        self.rig, self.program = rig, program
        #: two addresses of the router; it is at the first, unless told
        self.first = self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.other = f"tcp/127.0.0.1:{free_port()}"
        self.valve: Valve | None = None
        self._driver: Driver | None = None

    # -- what is there ---------------------------------------------------------------

    def serve(self, endpoint: str = "") -> float:
        """Start the fabric, and wait for it; when its router was there (monotonic)."""
        self.endpoint = endpoint or self.endpoint
        self.server: Program = self.rig.rems(
            "router", "serve", "--listen", self.endpoint, "--no-qr"
        )
        ready = until(self._answers, "the router", 60.0)
        self.server.wait_for("^Open fabric", 60.0)
        return ready

    def _answers(self) -> float | None:
        host, _, port = self.endpoint.removeprefix("tcp/").rpartition(":")
        try:
            socket.create_connection((host, int(port)), 1.0).close()
        except OSError:
            return None
        return time.monotonic()

    def start(self, *words: str, router: str = "", name: str = NAME) -> Robot:
        self.robot = Robot(
            self.rig, self.program, name, router or self.endpoint, *words
        )
        return self.robot

    def start_behind_valve(self, *words: str) -> Valve:
        self.valve = Valve(self.endpoint)
        self.start(*words, router=self.valve.endpoint)
        return self.valve

    def drive(self, endpoint: str = "") -> Driver:
        """Have somebody drive it from now on, and wait until it moves."""
        if self._driver is not None:
            self._driver.close()
        at = time.monotonic()
        self._driver = Driver(endpoint or self.endpoint, self.robot.name)
        self.robot.moved(at, 60.0)
        return self._driver

    def stop_driving(self) -> float:
        """From now on nobody says anything; when that was (monotonic)."""
        assert self._driver is not None
        at = time.monotonic()
        self._driver.close()
        self._driver = None
        return at

    def close(self) -> None:
        for one in (self._driver, self.valve):
            if one is not None:
                one.close()
