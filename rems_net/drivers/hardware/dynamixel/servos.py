"""Servos: base of the drivers of robots that move by X430 servos on one bus."""

from collections.abc import Mapping
from itertools import cycle
from threading import Event
from typing import Any, ClassVar

from rems_net.agents.ports import Out, Settings
from rems_net.agents.verbs import verb
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, Schema, integer, temperature, voltage
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.bus import Bus, Said
from rems_net.drivers.hardware.dynamixel.finding import REBOOT, find
from rems_net.drivers.hardware.dynamixel.table import Register, hardware_errors
from rems_net.drivers.hardware.serial import SerialDriven
from rems_net.errors import WireError
from rems_net.libraries import look_for

#: counts of 0.229 rpm. A servo that stands may measure so much.
STILL = 2


class Servos(SerialDriven):
    """Driver of X430 servos: finds them, sets them up, and watches that they obey.

    Write `names`, `still`, `found`, `goals` and `readings`.

    mode: the servos' operating mode.  goal: the register that each exchange sets.
    holds: whether the robot would fall without torque. If so, torque is switched off
    only to change a setting, and stays on at the end.
    """

    options = Settings(
        SerialDriven.options.fields,
        baud=integer(default=1_000_000, range=(9600, 4_500_000), doc="bits per second"),
    )
    status = Out(
        Schema(
            "dynamixel.status",
            {
                "voltage": voltage(doc="the lowest that a servo measures"),
                "temperature": temperature(doc="of the hottest servo"),
                "damaged": integer(doc="packets that were lost or damaged"),
            },
        )
    )
    rate = 50.0
    timeout = 0.01
    mode: ClassVar[int]
    goal: ClassVar[Register]
    holds: ClassVar[bool]

    bus: Bus
    #: whether to restart servos that report a hardware error
    _reboot = True
    #: whether no servo that was read in the newest exchange turns
    _still = False
    #: whether all servos were found once; whether they are set up now
    _seen_all = _up = False

    # -- written by a driver's author --------------------------------------------

    def names(self) -> Mapping[int, str]:
        """Return what each servo moves, by ID."""
        raise NotImplementedError(f"{type(self).__name__} must define names().")

    def models(self) -> Mapping[int, str]:
        """Return the names of the allowed models, by number; see `table.MODELS`."""
        return table.MODELS

    def still(self, said: Said) -> int:
        """Return the goal with which a servo with these registers stands still."""
        raise NotImplementedError(f"{type(self).__name__} must define still().")

    def found(self, said: Mapping[int, Said]) -> None:
        """Take in all servos' registers before the first exchange, while they stand."""
        raise NotImplementedError(f"{type(self).__name__} must define found().")

    def goals(self, command: DefDict) -> Mapping[int, int]:
        """Return the value of the `goal` register in counts, by ID."""
        raise NotImplementedError(f"{type(self).__name__} must define goals().")

    def readings(self, said: Mapping[int, Said]) -> dict[str, Mapping[str, Any]]:
        """Return fields by port, from the servos' speeds and positions."""
        raise NotImplementedError(f"{type(self).__name__} must define readings().")

    def asked(self) -> list[int]:
        """Return the IDs of the servos that are read in each exchange."""
        return list(self.names())

    # -- run in the device thread ------------------------------------------------

    def prepare(self) -> None:
        look_for("dynamixel_sdk", "hardware")
        super().prepare()

    def connect(self) -> None:
        """Find all servos and set them up: torque on, standing, watchdog running."""
        super().connect()
        assert self.line is not None
        # Not five times the (short) read timeout: writing may take long on a busy host.
        self.line.write_timeout = self.max_age / 2
        self.bus = Bus(self.line, self.options.port, self.names())
        self._round = cycle(self.names())
        self._health: dict[int, tuple[int, int]] = {}
        self._up = False
        try:
            self._set_all_up()
        except (WireError, TimeoutError) as error:  # Bus tried several times already
            raise NoDeviceError(
                f"{error}, though it did before. Check, in this order: 1. that no two "
                "servos have the same ID: both talk at once; 2. that no other program "
                f"uses {self.options.port}; 3. the cables: short, with a common "
                "ground, and plugged right in."
            ) from error
        self._up = self._seen_all = True
        self._reboot = False

    def _set_all_up(self) -> None:
        names = self.names()
        find(self.bus, names, self.models(), closely=not self._seen_all)
        # A servo that answers only reads would seem to be missing below.
        self.bus.sync_write(table.STATUS_RETURN, dict.fromkeys(names, 2))
        self.found({servo: self._set_up(servo) for servo in names})
        for servo in names:
            self._wake(servo)
        self._guard()

    def exchange(self, command: DefDict) -> Readings | None:
        """Send all goals, check one servo's health, and return the positions."""
        goals = self.goals(command)
        self.bus.sync_write(self.goal, goals)
        self._look_after(goals)
        # Last, since the readings count as of the return.
        first, last = table.PRESENT_VELOCITY, table.PRESENT_POSITION
        said = self.bus.sync_read(first, last, self.asked())
        self._still = all(abs(say(first)) <= STILL for say in said.values())
        readings = self.readings(said)
        volts, degrees = zip(*self._health.values(), strict=True)
        readings["status"] = {
            "voltage": min(volts) / 10,
            "temperature": float(max(degrees)),
            "damaged": self.bus.damaged,
        }
        return readings

    def is_still(self) -> bool:
        return self._still

    @property
    def stops_alone(self) -> float | None:
        return self._watchdog * table.WATCHDOG_STEP

    def disconnect(self) -> None:
        """Stop all servos, switch torque off unless `holds`, and close the port."""
        try:
            if self._up:
                self._up = False
                self.bus.sync_write(self.goal, self.goals(self.command.schema()))
                if not self.holds:
                    self.bus.sync_write(table.TORQUE, dict.fromkeys(self.names(), 0))
                # Closing the port discards unsent bytes; a ping waits until they left.
                self.bus.ping(next(iter(self.names())), tries=1)
        except OSError:
            pass  # the line is broken already
        finally:
            super().disconnect()

    @verb
    def reboot(self) -> None:
        """Restart servos that switched themselves off, as soon as possible."""
        self._reboot = True

    def _cured(self, servo: int) -> Said:
        """Return a servo's registers; restart it first if it reports an error."""
        said = self.bus.ask(servo)
        error = said(table.HARDWARE_ERROR)
        if error and self._reboot:
            self.note(f"starts {self.bus.name(servo)} anew: {hardware_errors(error)}")
            self._start_anew(servo)
            said = self.bus.ask(servo)
            error = said(table.HARDWARE_ERROR)
        if error:
            raise NoDeviceError(self._ill(servo, error))
        return said

    def _start_anew(self, servo: int) -> None:
        self.bus.reboot(servo)
        until = wall() + REBOOT
        Event().wait(REBOOT / 20)  # it still answers for a moment before it restarts
        while self.bus.ping(servo, tries=1) is None:
            if wall() > until:
                raise NoDeviceError(
                    f"{self.bus.name(servo)} was commanded to start anew, and is "
                    f"silent for {REBOOT:g} s. Switch its power off and on."
                )

    def _set_up(self, servo: int) -> Said:
        """Write the settings that this driver needs, and stop the servo.

        Returns its registers afterwards.
        """
        bus, said = self.bus, self._cured(servo)
        # The direction of counting depends on how the servo is mounted: keep that bit.
        # Other bits change the meaning of profiles, or let goals switch torque on.
        mounted = said(table.DRIVE_MODE) & table.REVERSE
        wanted = {table.DRIVE_MODE: mounted, table.OPERATING_MODE: self.mode}
        other = {
            register: to for register, to in wanted.items() if said(register) != to
        }
        guarded = said(table.WATCHDOG) != 0
        # When its watchdog is cleared, a servo may go on with its last goal.
        if other or (guarded and not self.holds):
            bus.write(servo, table.TORQUE, 0, "to switch its torque off")
        for place, to in other.items():
            bus.write(servo, place, to, "to be set to another operating mode")
        if other:
            said = bus.ask(servo)  # a new mode may count positions differently
        if guarded:
            bus.write(servo, table.WATCHDOG, 0, "to let its watchdog go")
        self._check_limits(servo, said)
        # Another program may have left less, or nothing; both are kept until power off.
        bus.write(servo, table.GOAL_PWM, said(table.PWM_LIMIT), "a PWM")
        bus.write(servo, self.goal, self.still(said), "to stand")
        return said

    def _check_limits(self, servo: int, said: Said) -> None:
        """Look at the limits that are set in a servo, and that we cannot exceed.

        Raises NoDeviceError if it could not move.
        """
        name, pwm = self.bus.name(servo), said(table.PWM_LIMIT)
        for limit, value in (
            ("PWM Limit", pwm),
            ("Velocity Limit", said(table.VELOCITY_LIMIT)),
        ):
            if not value:
                raise NoDeviceError(
                    f"{name} cannot move: its {limit} is 0. Set another one with "
                    "DYNAMIXEL Wizard."
                )
        if self._seen_all:
            return
        if pwm < table.FULL_PWM:
            share = 100 * pwm / table.FULL_PWM
            self.note(f"has little force at {name}: its PWM Limit is {share:.0f} %")
        if self.mode == table.EXTENDED_MODE and (off := said(table.HOMING_OFFSET)):
            degrees = off * 360 / table.TURN
            self.note(
                f"counts angles of {name} from {degrees:.1f} degrees: its Homing Offset"
            )

    def _wake(self, servo: int) -> None:
        """Switch the servo's torque on. Raises NoDeviceError if it stays off."""
        bus = self.bus
        bus.write(servo, table.TORQUE, 1, "to switch its torque on")
        said = bus.ask(servo)
        if error := said(table.HARDWARE_ERROR):
            raise NoDeviceError(self._ill(servo, error))
        if not said(table.TORQUE):
            raise NoDeviceError(
                f"{bus.name(servo)} keeps its torque off, though the command was to "
                "switch it on. Check, in this order: 1. that its supply has the "
                "voltage that is printed on it; 2. whether its LED blinks: then switch "
                "its power off and on; 3. that it turns freely by hand."
            )

    def _guard(self) -> None:
        """Start all watchdogs at once: one by one, the first would expire early."""
        self.bus.sync_write(table.WATCHDOG, dict.fromkeys(self.names(), self._watchdog))

    @property
    def _watchdog(self) -> int:
        """Steps of the servos' watchdog: max_age, as far as they can count."""
        steps = int(self.max_age / table.WATCHDOG_STEP + 1e-9)
        return min(max(steps, 1), 127)

    def _look_after(self, goals: Mapping[int, int]) -> None:
        """Check torque, goal and watchdog of one servo: each in turn, alerts first.

        Raises OSError if the servo has stopped by itself, WireError for a wrong goal.
        """
        bus = self.bus
        servo = bus.alerts.pop() if bus.alerts else next(self._round)
        said = bus.ask(servo, table.TORQUE, tries=2)  # each may last 45 ms
        error = said(table.HARDWARE_ERROR)
        if not said(table.TORQUE):
            raise OSError(
                self._ill(servo, error)
                if error
                else f"{bus.name(servo)} has lost its torque: it started anew, maybe "
                "for lack of power"
            )
        watchdog = said(table.WATCHDOG)
        if not watchdog:
            self._guard()  # the packet that set it was lost
        if watchdog < 0:
            raise OSError(f"the watchdog of {bus.name(servo)} has stopped it")
        if said(self.goal) != goals[servo]:
            raise WireError(
                f"{bus.name(servo)} obeys another command than it was sent: it was "
                "damaged on its way"
            )
        self._health[servo] = said(table.VOLTAGE), said(table.TEMPERATURE)

    def _ill(self, servo: int, error: int) -> str:
        call = f"then type: rems call {self.key} reboot"
        then = call if self._seen_all else "try again."
        return (
            f"{self.bus.name(servo)} reports a hardware error: "
            f"{hardware_errors(error)}. Take the cause away; {then}"
        )
