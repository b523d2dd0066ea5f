"""Robot: a definition (schemas and kinematics) joined with a driver (motion)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import wraps
from numbers import Integral
from typing import TYPE_CHECKING, Any, ClassVar

from rems_net.agents.about.standing import Standing
from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import lacking
from rems_net.agents.ports import In, Out, Settings, Slot, merge_slots
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import is_verb, verb
from rems_net.bodies.body import Embodied
from rems_net.defdict import DefDict, Schema, anew, angle, changed, length, many_turns
from rems_net.errors import SchemaError
from rems_net.events import warn
from rems_net.kinematics.articulated import Articulated
from rems_net.scenes import marking

if TYPE_CHECKING:
    from rems_net.scenes.scene import Scene
    from rems_net.scenes.shared import Shared

#: Where a robot is bolted down, if its state does not have it; also in `initial`.
PLACE = Schema(
    "place",
    {"x": length(), "y": length(), "heading": angle(doc="counter-clockwise from +x")},
)
#: Methods of definitions that a definition with several bases combines, if it does not
#: define them itself.
UNITED = ("derivative", "advance", "measure", "mechanisms", "noise")


class Robot(Articulated, Agent):
    """Base of every robot, simulated or real.

    command: target values      state: reached values      sensors: measured values
    marker: its printed marker, if it has one

    The safe command is the default values of the command's schema. The robot obeys it
    before the first command arrives, and again if no valid command has come for
    `max_age` seconds of fabric time: a robot stops by itself.
    """

    kind = "robot"
    max_age: ClassVar[float] = 0.5
    #: whether it has something to command; a camera has not
    obeys: ClassVar[bool] = True
    #: The world that the robot shares with others; None for a robot that is alone.
    shared: "Shared | None" = None
    #: The world that `reset` uses: the shared one, or a simulator's own.
    _world: "Shared | None" = None
    #: m, m, rad. Where the robot is bolted down, if its state does not have it.
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)

    parameters = Settings()
    command = In()
    state = Out()
    sensors = Out()
    marker = Out()

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "reset" in vars(cls):
            raise SchemaError(
                f"{cls.__name__} defines reset(), by which a world puts robots back; "
                "call the method rewind(self), and begin it with super().rewind()."
                " (R0505)"
            )
        for name, method in vars(cls).items():
            if is_verb(method) and not is_verb(getattr(Robot, name, method)):
                raise SchemaError(
                    f"{cls.__name__}.{name} is a verb, and every robot has something "
                    f"else by the name {name!r}; call it my_{name}. (R0505)"
                )

    def __init__(
        self,
        name: str = "",
        *,
        parameters: Mapping[str, Any] | None = None,
        initial: Mapping[str, Any] | None = None,
        marker: Mapping[str, Any] | None = None,
        **rest: Any,
    ):
        super().__init__(name, **rest)
        self._fill("parameters", parameters)
        self.initial = dict(initial or {})
        #: its marker as it is written; empty for none
        self.marked = dict(marker or {})

    def _parameters(self) -> DefDict:
        return self.parameters

    def published(self) -> dict[str, Schema]:
        """Return the schemas of its Outs, and of the command that it obeys."""
        return {"command": self.command.schema, **super().published()}

    def prepare(self) -> None:
        super().prepare()
        for port in ("command", "state"):
            if port not in self.__dict__:
                raise SchemaError(
                    f"{type(self).__name__} has no {port}: write in the definition "
                    f"`{port} = {'In' if port == 'command' else 'Out'}(Schema(...))`."
                    " (R0509)"
                )
        if self.marked:
            self._marking = marking.of_robot(self, self.marked)
            self.settle("marker", marking.MARKER)
        #: the schema of `initial`
        self.initial_schema = self._initial_schema()
        self.rewind()

    def _initial_schema(self) -> Schema:
        """Return the state's schema, with the place of a bolted-down robot."""
        state = self.state.schema
        place = {path: field for path, field in PLACE.rows() if path not in state}
        if not place or not isinstance(self, Embodied) or not self.body().fixed:
            return state
        return Schema(state.name, {**state.entries, **place})

    def begins(self) -> DefDict:
        """Return the state in which it starts. `place` has where it is bolted down."""
        state, starts = self.state.schema, self.initial_schema
        if starts is state:
            return state(self.initial)
        initial = starts(self.initial)
        x, y, heading = (0.0 if p in state else initial[p] for p in PLACE.paths)
        self.place = x, y, heading
        return state({path: initial[path] for path in state.paths})

    @verb
    def reset(
        self, seed: int | None = None, initial: Mapping[str, Any] | None = None
    ) -> None:
        """Put it back to where the experiment starts; see `rewind`.

        seed: of its random numbers and its noise from now on; the same ones without it.
        initial: where it starts from now on. Raises SchemaError for a wrong field.
        """
        self.begin_at(seed, initial)
        if self._world is None:
            self.rewind()
        else:
            self._world.reset([self])

    def begin_at(self, seed: int | None, initial: Mapping[str, Any] | None) -> None:
        """Set the seed and the start of the next `rewind`; None keeps what there is."""
        if initial is not None:
            self.initial_schema(initial)  # raises an error before anything has changed
            self.initial = dict(initial)
            for path, turns in self.odd_turns():
                warn("turns", f"{self.key} starts at {path}, which is {turns}")
        if seed is not None:
            if not isinstance(seed, Integral):
                raise SchemaError(
                    f"reset() takes a whole number as its seed, and got {seed!r:.60}; "
                    'a start is initial={"x": 0.1}. (R0502)'
                )
            runtime(self).seed = seed
            self.__dict__.pop("random", None)

    def odd_turns(self) -> Iterator[tuple[str, str]]:
        """Yield each angle of its start that is beyond a turn, and what to write."""
        groups = [("", self.initial)]
        for group, values in groups:
            for name, value in values.items():
                path = f"{group}{name}"
                unit = getattr(self.initial_schema.find(path), "unit", "")
                if isinstance(value, Mapping):
                    groups.append((f"{path}/", dict(value)))
                elif turns := many_turns(value, unit):
                    yield f"{path} = {value:g}", turns

    def rewind(self) -> None:
        """Put the state back, and all else that the robot itself keeps."""
        ins = self.ins()
        for port, schema in self.schemas().items():
            if port in ins:
                self.__dict__[port] = anew(self.__dict__[port])
            else:
                setattr(self, port, schema())
        self.state = self.begins()
        if self.marked:
            self.marker = self._marking

    def motor_schema(self) -> Schema:
        """Return the schema of its motors' command. Raises SchemaError if none."""
        told = self.motor_command(self.schemas()["command"]())
        if isinstance(told, DefDict):
            return told.schema
        raise SchemaError(
            f"{type(self).__name__}.motor_command() returned {told!r:.60}; expected a "
            "value of a schema that has all fields of the command, and what motors "
            "obey besides: command.schema.merge(Schema(...)). (R0503)"
        )

    def step(self, tick: Tick) -> None:
        """Obey the command over (t - dt, t], then measure the result."""
        self.obey(tick)
        self.drive(self.acting(tick.dt), tick.dt)
        self.sense()

    def obey(self, tick: Tick) -> None:
        """Replace the command by the safe one if it is no longer valid."""
        run = runtime(self)
        # Of several writers, each has an age of its own.
        age = 0.0 if run.shares else run.command_age(tick)
        if run.must_stand(age, self.max_age):
            be_safe(self)
        elif run.shares and (safe := run.overdue(tick, self.max_age)):
            self.__dict__["command"] = changed(self.command, safe)

    @property
    def standing(self) -> Standing:
        """Whether it stands still, as far as that is known, for STOP's receipt.

        Any thread may read it.
        """
        safe = runtime(self).stopped or self.command == self.command.schema()
        return Standing("simulated" if safe else "sent")

    def acting(self, dt: float) -> DefDict:
        """Return the command that acts in the next `dt` seconds. Call it once a step.

        Of a simulated robot, it is what its motors make of the command.
        """
        return self.command

    def drive(self, command: DefDict, dt: float) -> None:
        """Let `command` act for `dt` seconds. The first method of a driver."""
        raise lacking(driver_of(type(self)), "robot", "drive(self, command, dt)")

    def sense(self) -> None:
        """Update `state` and `sensors`. The second method of a driver."""
        raise lacking(driver_of(type(self)), "robot", "sense(self)")


def be_safe(agent: Agent) -> None:
    """Give an agent its safe command, as a new value. The old value is not changed."""
    agent.__dict__["command"] = anew(agent.__dict__["command"])


def takes_commands(agent: Agent | type[Agent]) -> bool:
    """Return whether programs outside a run may command it: a robot, and some inputs.

    Such an input has an In `command`, such as the stick that a person moves.
    """
    if agent.kind != "input":
        return agent.kind == "robot"
    port = agent.ins().get("command")
    return port is not None and not port.is_open


class Definition(Robot):
    """Schemas, dimensions and kinematics of a robot. Pure: no I/O.

    A definition names the ports `command`, `state`, `sensors` and the `parameters`, and
    has the methods that drivers need; a driver reports what is missing. A definition
    with several bases, `class Youbot(YoubotBase, YoubotArm)`, has all their fields, and
    all results of their `derivative`, `advance`, `measure`, `mechanisms` and `noise`,
    except those that it defines itself. If two bases define a field differently, an
    error names both; if both compute the motion of a field, the first base counts.

    Mathematics: `derivative(state, command)` gives the rates of fields, per second.
    `advance(state, command, dt)` gives, for fields that move to a target and stop there
    (an arm's joints), their values `dt` seconds later. `measure(state, command)` gives
    what the sensors read. `motor_command(command)` gives the command of the motors, if
    it is not `command` itself. An arm's safe command holds it where it is: a driver of
    its servos therefore sends the result of `advance` from the previous set-point, not
    the target.
    """

    #: How far the state may be from the result of the definition's own mathematics, in
    #: slow motion, as a share of the distance moved: one number, or by field,
    #: {"heading": 0.15}. `rems check` tests it for every driver; docs/robots.md.
    tolerance: ClassVar[float | Mapping[str, float]] = 0.05
    #: s. Time to reach a tenth of full speed in slow motion, and to come to rest again:
    #: more for robots that are heavy for their grip.
    eases: ClassVar[float] = 0.5
    #: How the kinematic driver integrates `derivative`, if its options do not set it:
    #: "euler" or "rk4"; "" for "rk4" in four substeps.
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


#: The implementations that every definition inherits; no robot has changed them.
_PLAIN = {getattr(Definition, name, None) for name in UNITED}


def _united(methods: Sequence[Callable[..., Any]]) -> Any:
    """Return a method that joins the results of these; of a field, the first counts."""

    @wraps(methods[0])
    def united(self: Any, *words: Any) -> Any:
        whole: dict[str, Any] = {}
        for method in methods:
            part = method(self, *words)
            if not isinstance(part, Mapping):
                return part  # the caller reports the mistake
            for path, value in part.items():
                whole.setdefault(path, value)
        return whole

    return united


class Driver(Robot):
    """How a robot moves: by a model, a simulator or hardware.

    Write `drive` and `sense`; acquire in `open`, give back in `close`. A driver's
    settings are its `options`.
    """

    #: Whether a process can hold only one robot of this driver.
    one_per_process: ClassVar[bool] = False

    def likeness(self) -> object:
        """Return a key that is equal for robots that are stepped together."""
        if self.shared is not None:
            return id(self.shared)
        if self.adjustable:  # its settings may become others at any tick
            return self.key
        settings = self.parameters.encode(), self.options.encode()
        return type(self), runtime(self).every, *settings

    @classmethod
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None] | None:
        """Return a function that steps all these robots at once; None: each by itself.

        The robots share a host, a class, parameters and options. The result must equal
        that of `step` on each, to the last bit: it is only faster.
        """
        return None

    @classmethod
    def share(cls, robots: Sequence[Any], scene: "Scene") -> "Shared":
        """Return the world that these robots of this driver share.

        Nothing is acquired before the first robot is opened. Raises SchemaError for
        robots that cannot be in it as they are.
        """
        raise SchemaError(
            f"the driver {driver_of(cls).__name__} has no worlds: those of kinematic, "
            "mujoco and pybullet can be shared. (R0432)"
        )


def definition_of(cls: type) -> type:
    """Return the definition of a robot's class; the class itself if there is none."""
    bases = (b for b in cls.__mro__ if issubclass(b, Definition))
    return next((b for b in bases if not issubclass(b, Driver)), cls)


def driver_of(cls: type[Robot]) -> type[Robot]:
    """Return the driver class of a robot's class; the class itself if there is none."""
    drivers = (b for b in cls.__mro__ if issubclass(b, Driver))
    return next((b for b in drivers if not issubclass(b, Definition)), cls)


def combine(definition: type[Definition], driver: type[Driver]) -> type[Robot]:
    """Return the robot class `class X(definition, driver)`, made once for the user."""
    both = (definition, driver)
    if both not in _joined:
        name = f"{driver.__name__}{definition.__name__}"
        doc = f"{definition.__name__}, done by {driver.__name__}."
        _joined[both] = type(name, both, {"__doc__": doc, "__module__": __name__})
    return _joined[both]


_joined: dict[tuple[type[Definition], type[Driver]], type[Robot]] = {}
