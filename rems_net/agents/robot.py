"""Robot: a definition (what it is) joined with a driver (how it is done)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import lacking
from rems_net.agents.ports import In, Out, Settings, Slot, merge_slots
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import verb
from rems_net.bodies.body import Embodied
from rems_net.defdict import DefDict, Schema, anew, angle, changed, length
from rems_net.errors import SchemaError
from rems_net.kinematics.articulated import Articulated

if TYPE_CHECKING:
    from rems_net.agents.world import Shared
    from rems_net.scenes.scene import Scene

#: Where a robot is bolted down, unless its state says so: `initial` takes that, too.
PLACE = Schema(
    "place",
    {"x": length(), "y": length(), "heading": angle(doc="counter-clockwise from +x")},
)
#: mathematics of definitions that a definition of several unites, where it does not
#: write its own
UNITED = ("derivative", "advance", "measure", "mechanisms", "noise")


class Robot(Articulated, Agent):
    """What every robot is, whichever way it is done.

    command: what it is told      state: where it is      sensors: what it measures

    The safe command is the defaults of the command's schema. It is what the robot
    obeys before it is told anything, and again when nothing valid has come for
    `max_age` seconds of fabric time: a robot stops by itself.
    """

    kind = "robot"
    max_age: ClassVar[float] = 0.5
    #: the world that it shares with others; None for a robot that is alone
    shared: Shared | None = None
    #: the world that puts it back: the shared one, or a simulator's own
    _world: Shared | None = None
    #: where it is bolted down, if its state does not say: x and y in m, heading in rad
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)

    parameters = Settings()
    command = In()
    state = Out()
    sensors = Out()

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "reset" in vars(cls):
            raise SchemaError(
                f"{cls.__name__} defines reset(), by which a world puts robots back; "
                "call the method rewind(self), and begin it with super().rewind()."
            )

    def __init__(
        self,
        name: str = "",
        *,
        parameters: Mapping[str, Any] | None = None,
        initial: Mapping[str, Any] | None = None,
        **rest: Any,
    ):
        super().__init__(name, **rest)
        self._fill("parameters", parameters)
        self.initial = dict(initial or {})

    def _parameters(self) -> DefDict:
        return self.parameters

    def published(self) -> dict[str, Schema]:
        """Its Outs, and its command: what it obeys, after conversion and limits."""
        return {"command": self.command.schema, **super().published()}

    def prepare(self) -> None:
        super().prepare()
        for port in ("command", "state"):
            if port not in self.__dict__:
                raise SchemaError(
                    f"{type(self).__name__} has no {port}: a definition says "
                    f"`{port} = {'In' if port == 'command' else 'Out'}(Schema(...))`."
                )
        #: the schema of `initial`
        self.initial_schema = self._initial_schema()
        self.rewind()

    def _initial_schema(self) -> Schema:
        """The state, and the place of a robot that is bolted down anywhere else."""
        state = self.state.schema
        place = {path: field for path, field in PLACE.rows() if path not in state}
        if not place or not isinstance(self, Embodied) or not self.body().fixed:
            return state
        return Schema(state.name, {**state.entries, **place})

    def begins(self) -> DefDict:
        """Return the state in which it starts; where it is bolted down is `place`."""
        state, starts = self.state.schema, self.initial_schema
        if starts is state:
            return state(self.initial)
        initial = starts(self.initial)
        x, y, heading = (0.0 if p in state else initial[p] for p in PLACE.paths)
        self.place = x, y, heading
        return state({path: initial[path] for path in state.paths})

    @verb
    def reset(self) -> None:
        """Put it back to where the experiment starts; what it keeps, by `rewind`."""
        if self._world is None:
            self.rewind()
        else:
            self._world.reset([self])

    def rewind(self) -> None:
        """Put the state back, and all else that the robot itself keeps."""
        ins = self.ins()
        for port, schema in self.schemas().items():
            if port in ins:
                self.__dict__[port] = anew(self.__dict__[port])
            else:
                setattr(self, port, schema())
        self.state = self.begins()

    def motor_schema(self) -> Schema:
        """Return what its motors can be told. Raises SchemaError for no such value."""
        told = self.motor_command(self.schemas()["command"]())
        if isinstance(told, DefDict):
            return told.schema
        raise SchemaError(
            f"{type(self).__name__}.motor_command() returned {told!r:.60}; expected a "
            "value of a schema that has all fields of the command, and what motors "
            "obey besides: command.schema.merge(Schema(...))."
        )

    def step(self, tick: Tick) -> None:
        """Obey the command over (t - dt, t], then say where that led."""
        self.obey(tick)
        self.drive(self.command, tick.dt)
        self.sense()

    def obey(self, tick: Tick) -> None:
        """Replace the command by the safe one if it is not valid any more."""
        run = runtime(self)
        if run.must_stand(run.command_age(tick), self.max_age):
            be_safe(self)
        elif run.shares and (safe := run.overdue(tick, self.max_age)):
            self.__dict__["command"] = changed(self.command, safe)

    @property
    def stands(self) -> bool:
        """Whether it stands still because of STOP."""
        return runtime(self).stopped

    def drive(self, command: DefDict, dt: float) -> None:
        """Let `command` act for `dt` seconds. A driver's first method."""
        raise lacking(driver_of(type(self)), "robot", "drive(self, command, dt)")

    def sense(self) -> None:
        """Bring `state` and `sensors` up to date. A driver's second method."""
        raise lacking(driver_of(type(self)), "robot", "sense(self)")


def be_safe(robot: Robot) -> None:
    """Give a robot its safe command, as a new value: the one before stays as it is."""
    robot.__dict__["command"] = anew(robot.command)


class Definition(Robot):
    """What a robot is: its schemas, dimensions and kinematics. Pure, no I/O.

    A definition names the ports `command`, `state`, `sensors` and the `parameters`,
    and offers what drivers ask for; a driver says what it misses. One that inherits
    from several has all their fields, and all that their `derivative`, `advance`,
    `measure`, `mechanisms` and `noise` give, where it does not say its own:
    `class Youbot(YoubotBase, YoubotArm)`. A field that two of them define differently
    is refused, with both named; where two say how it moves, the first one counts.

    Mathematics: `derivative(state, command)` gives the rates of fields, per second;
    `advance(state, command, dt)` where fields are `dt` seconds later that go to a
    target and halt there, as the joints of an arm; `measure(state, command)` what the
    sensors read; `motor_command(command)` what motors are told, where that is not the
    command. An arm's safe command holds it where it is: whoever drives its servos
    gives them what `advance` says of what they were told before, not the target itself.
    """

    #: How far its state may be from what its own mathematics says, in slow motion, as
    #: a share of how far that goes: one number, or by field, {"heading": 0.15}. Held
    #: by `rems check` of every driver; docs/robots_check.md.
    tolerance: ClassVar[float | Mapping[str, float]] = 0.05
    #: How long it takes, s, to come up to a tenth of its full speed in slow motion, and
    #: to rest again: more for what is heavy by its grip.
    eases: ClassVar[float] = 0.5
    #: By what the kinematic driver integrates its `derivative`, if its options do not
    #: say: "euler" or "rk4"; "" for "rk4" in four substeps.
    integrator: ClassVar[str] = ""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        bases = [b for b in cls.__bases__ if issubclass(b, Definition)]
        for name in ("parameters", "command", "state", "sensors"):
            found: dict[int, tuple[Slot, str]] = {}
            for base in bases:
                slot = getattr(base, name)
                if slot is not vars(Robot)[name]:
                    found.setdefault(id(slot), (slot, base.__name__))
            if len(found) > 1 and name not in vars(cls):
                merged = merge_slots(list(found.values()), f"{cls.__name__}.{name}")
                setattr(cls, name, merged)
                merged.__set_name__(cls, name)
        for name in UNITED:
            methods = [getattr(base, name, None) for base in bases]
            own = [m for m in dict.fromkeys(methods) if m and m not in _PLAIN]
            if len(own) > 1 and name not in vars(cls):
                setattr(cls, name, _united(own))


#: what every definition has, and no robot has said
_PLAIN = {getattr(Definition, name, None) for name in UNITED}


def _united(methods: Sequence[Callable[..., Any]]) -> Any:
    """One method that gives what all these do; of a field, what the first one says."""

    @wraps(methods[0])
    def united(self: Any, *words: Any) -> Any:
        whole: dict[str, Any] = {}
        for method in methods:
            part = method(self, *words)
            if not isinstance(part, Mapping):
                return part  # who asked says what is wrong with it
            for path, value in part.items():
                whole.setdefault(path, value)
        return whole

    return united


class Driver(Robot):
    """How a robot is done: a model, a simulator or hardware.

    Write `drive` and `sense`; acquire in `open`, give back in `close`. What the
    driver can be told is its `options`.
    """

    #: whether a process can hold one robot of it at a time, and no more
    one_per_process: ClassVar[bool] = False

    def likeness(self) -> object:
        """Equal for robots that are stepped at once: by `swarm`, or in one world."""
        if self.shared is not None:
            return id(self.shared)
        settings = self.parameters.encode(), self.options.encode()
        return type(self), runtime(self).every, *settings

    @classmethod
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None] | None:
        """Return what steps all these robots at once; None for one after another.

        They share a host, a class, parameters and options. What it does must be the
        same, to the last bit, as `step` on each: only faster.
        """
        return None

    @classmethod
    def share(cls, robots: Sequence[Any], scene: Scene) -> Shared:
        """Return the world in which these robots, done by this driver, are together.

        Nothing is acquired before the first of them is opened. Raises SchemaError for
        robots that cannot be in it as they are.
        """
        raise SchemaError(
            f"the driver {driver_of(cls).__name__} has no worlds: those of kinematic, "
            "mujoco and pybullet can be shared."
        )


def driver_of(cls: type[Robot]) -> type[Robot]:
    """Return the driver by which a robot's class is done; itself if there is none."""
    drivers = (b for b in cls.__mro__ if issubclass(b, Driver))
    return next((b for b in drivers if not issubclass(b, Definition)), cls)


def combine(definition: type[Definition], driver: type[Driver]) -> type[Robot]:
    """The robot class `class X(definition, driver)`, made once for the user."""
    both = (definition, driver)
    if both not in _joined:
        name = f"{driver.__name__}{definition.__name__}"
        doc = f"{definition.__name__}, done by {driver.__name__}."
        _joined[both] = type(name, both, {"__doc__": doc, "__module__": __name__})
    return _joined[both]


_joined: dict[tuple[type[Definition], type[Driver]], type[Robot]] = {}
