"""Body: motion, counters and battery of an emulated Create 2."""

from collections.abc import Mapping
from math import floor, pi
from typing import Any

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2.packets import COUNTS, WRAP, bits
from rems_net.drivers.hardware.create2.readings import CLIFFS, LIGHTS, SIDES
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.robots.create2 import Create2

#: mAh; mA while it stands; mA for each wheel that turns. Guesses.
CAPACITY, STANDS, TURNS = 2696, 180, 150
#: Counts. Signal of a cliff sensor over a floor, and over an edge. Guesses.
FLOOR, NOTHING = 2000, 5
#: s. Length of a press of a button.
PRESS = 0.2


class Body:
    """A kinematic Create 2, and what happens to it.

    right, left: commanded speeds of the wheels, mm/s.  parameters: of this one robot.
    """

    def __init__(self, parameters: Mapping[str, Any] | None = None):
        self.right = self.left = 0
        self.bumps: set[str] = set()
        self.lifted = self.cliff = self.charger = False
        self.button = ""
        self._pressed = 0.0
        self.used = 0.0  # mAh
        #: charge and capacity that its battery reports, mAh; None for the true ones
        self.reports: tuple[int, int] | None = None
        self._zero = (0, 0)
        self.robot = combine(Create2, Kinematic)("create2", parameters=parameters)
        self.robot.prepare()

    def move(self, dt: float) -> None:
        """Let `dt` seconds pass."""
        p = self.robot.parameters
        for side, told in (("left", self.left), ("right", self.right)):
            speed, top = told / 1000 / p.wheel_radius, p.max_wheel_speed
            self.robot.command[f"wheel/{side}"] = max(-top, min(top, speed))
        self.robot.drive(self.robot.acting(dt), dt)
        self.robot.sense()
        current = -2000 if self.charger else self.current
        self.used = min(max(0.0, self.used + current * dt / 3600), CAPACITY)
        self._pressed -= dt
        if self._pressed < 0:
            self.button = ""

    def restart(self) -> None:
        """Stop and count from zero, as after a loss of power."""
        self.right = self.left = 0
        self._zero = self._counts()

    def press(self, button: str) -> None:
        """Press a button for a moment."""
        self.button, self._pressed = button, PRESS

    @property
    def current(self) -> int:
        """Current that it draws, mA."""
        return STANDS + TURNS * (bool(self.left) + bool(self.right))

    @property
    def over_nothing(self) -> bool:
        """Whether it moves so that it could fall off an edge.

        This is ahead, or back in a curve that is tighter than the robot is wide.
        """
        ahead, turn = self.left + self.right, abs(self.right - self.left)
        p = self.robot.parameters
        tight = abs(ahead) * p.track / 2 < turn * 0.17
        return self.cliff and (ahead > 0 or tight)

    def values(self) -> dict[str, int]:
        """Return the values of the packets that the body determines, by name."""
        left, right = self._counts()
        sensed = self.robot.sensors
        hit = self.bumps | {side for side in SIDES if sensed[f"bumper/{side}"]}
        wheels = [f"bump_{side}" for side in hit]
        wheels += ["drop_left", "drop_right"] if self.lifted else []
        charge = CAPACITY - round(self.used)
        found = {
            "bumps_and_wheel_drops": bits("bumps_and_wheel_drops", wheels),
            "buttons": bits("buttons", [self.button] if self.button else []),
            "encoder_left": _wrapped(left - self._zero[0]),
            "encoder_right": _wrapped(right - self._zero[1]),
            "chargers": int(self.charger),
            "charging": 2 if self.charger else 0,
            "voltage": 14_400 + 2_000 * charge // CAPACITY,
            "current": 2000 if self.charger else -self.current,
            "temperature": 25,
            "charge": self.reports[0] if self.reports else charge,
            "capacity": self.reports[1] if self.reports else CAPACITY,
            "motor_left": TURNS if self.left else 0,
            "motor_right": TURNS if self.right else 0,
            "light_bumps": bits("light_bumps", hit),
        }
        for place in CLIFFS:
            found[f"cliff_{place}"] = int(self.cliff)
            found[f"cliff_{place}_signal"] = NOTHING if self.cliff else FLOOR
        for place in LIGHTS:
            found[f"light_{place}"] = 4000 if place in hit else 0
        return found

    def _counts(self) -> tuple[int, int]:
        state = self.robot.state
        left, right = state["wheel/left"], state["wheel/right"]
        return floor(left * COUNTS / (2 * pi)), floor(right * COUNTS / (2 * pi))


def _wrapped(count: int) -> int:
    """Return a count as 16 bits hold it."""
    return (count + WRAP // 2) % WRAP - WRAP // 2
