"""Estimator: where a robot is, from its commands, its sensors and its definition.

The belief is a mean and a root of the covariance, of the state and of the constant
offsets of its sensors. A step adds the errors of the commands, moves all by the
definition's own `derivative`, and compares the sensors with its own `measure`: so a
gyroscope shows how far the wheels really turned. No Jacobian is written by hand. The
pose of a camera counts at the time of its picture: `past.py`.
"""

from collections.abc import Iterator, Mapping
from math import degrees, sqrt
from typing import Any, ClassVar

import numpy as np

from rems_net.agents.agent import Agent, Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.bodies.noise import Noise
from rems_net.defdict import (
    Schema,
    many_turns,
    number,
    parse_quantity,
    ratio,
    text,
    time,
)
from rems_net.drivers.kinematic.model import POSE
from rems_net.drivers.noise import table
from rems_net.errors import ExperimentError
from rems_net.events import warn
from rems_net.maths import hypot
from rems_net.maths.ukf import (
    Floats,
    Less,
    Moments,
    points,
    predicted,
    product,
    updated,
)
from rems_net.processes import localise
from rems_net.processes.fields import Turns, field_of, odd, pairs
from rems_net.processes.model import command_of, model_of, noises
from rems_net.processes.motion import Motion
from rems_net.processes.past import KEPT, Belief, Past, Poses, Seen, Span

#: Number of deviations. A start that is farther away is another place.
SURE = 4.0
#: Differences as small as this are rounding errors.
ROUND = 1e-9
#: Least variance of a reading, in its unit: with 0 nothing could be divided by it.
LEAST = 1e-18


class Estimator(Process):
    """Base of filters that estimate a robot's state: `ekf` and `ukf`.

    command: what the robot was commanded      sensors: its readings
    pose: of a camera, with its covariance and the tick of its picture
    state: the estimate, as the definition has it      deviation: standard deviation of
    each field, in its unit      covariance: of each pair of fields, such as m*rad
    """

    #: distance of the sigma points, as a share of the usual one
    alpha: ClassVar[float] = 1.0

    options = Settings(
        definition=text(doc="of the robot: woodbot, or my.py:Cart"),
        parameters=text(max_len=4096, doc='of it: track = "100 mm", or a file'),
        initial=text(max_len=4096, doc='where it starts: x = "10 cm"'),
        unsure=text(max_len=4096, doc='standard deviation of that: x = "5 mm"'),
        slip=ratio(default=0.03, range=(0, 1), doc="error of a command, in each step"),
        drift=text(max_len=4096, doc='error besides, in 1 s: heading = "1 deg"'),
        noise=text(max_len=4096, doc="of sensors, if not as defined: gyro/z = 0.01"),
        bridge=time(default=2.0, range=(0, 60), doc="its state is fresh without poses"),
    )
    command = In()
    sensors = In(optional=True)
    pose = In(
        localise.POSE.slice("x", "y", "heading", "covariance", "tick"), optional=True
    )
    state = Out()
    deviation = Out()
    covariance = Out()
    _belief: Belief

    def prepare(self) -> None:
        """Build the definition, and settle the Outs. Raises ExperimentError."""
        super().prepare()
        self.model = robot = model_of(self)
        schema = robot.state.schema
        self._paths = [path for path, one in schema.rows()]
        rows = {**dict(robot.command.schema.rows()), **dict(schema.rows())}
        if wrong := [path for path, one in rows.items() if odd(one)]:
            raise ExperimentError(
                f"{wrong[0]!r} of {self.options.definition} is no single number, which "
                "an estimator needs; give it a definition without that field. (R0881)"
            )
        self.settle("state", schema)
        units = {path: number(one.unit) for path, one in schema.rows()}
        self.settle("deviation", Schema("estimate.deviation", units))
        self.settle("covariance", Schema("estimate.covariance", pairs(schema)))
        reads = runtime(self).sources
        if not {"sensors", "pose"} & {*reads}:
            raise ExperimentError(
                f"{self.key} reads neither sensors nor a pose, so nothing corrects its "
                'estimate; write sensors = "robot/bot/sensors", or the pose that a '
                'camera finds: pose = "process/eyes/bot". (R1108)'
            )
        self._noises = noises(self, robot) if "sensors" in reads else {}
        self._used = [*self._noises]
        self._settings()
        if "pose" in reads:
            self._poses = Poses(schema, self.options.definition)
            given = (table(self.options[one], one) for one in ("initial", "unsure"))
            self._placed = any(path in one for one in given for path in POSE)
            if not self._placed:
                self._belief = self._poses.unknown(self._belief)

    def doubts(self, agents: Mapping[str, Agent]) -> Iterator[str]:
        """Yield a start in degrees without their unit, and one that is elsewhere."""
        for path, one in table(self.options.initial, "initial").items():
            if turns := many_turns(one, field_of(self.state.schema, path, "").unit):
                yield f"{self.key} begins at {path} = {one:g}, which is {turns}"
        sources = runtime(self).sources
        robot = agents.get(sources["command"].rpartition("/")[0])
        if not isinstance(robot, Robot) or "pose" in sources:
            return
        begins, spread = robot.begins(), np.diag(self._belief.root)
        for path, here, far in zip(
            self._paths, self._belief.mean, spread, strict=False
        ):
            if abs((there := begins.get(path, here)) - here) > SURE * far + ROUND:
                yield (
                    f"{self.key} begins at {path} = {here:g}, and {robot.key} at "
                    f"{there:g}; write such as options initial = '{path} = {there:g}'"
                )
                return

    def _settings(self) -> None:
        """Begin with the belief that the options state."""
        schema, names = self.model.state.schema, ("initial", "unsure", "drift")
        first, unsure, drift = (
            self._numbers(schema, table(getattr(self.options, name), name), name)
            for name in names
        )
        offsets = [path for path in self._used if self._noises[path].bias]
        self._offsets = [self._used.index(path) for path in offsets]
        # An offset is anywhere between its limits: the deviation of such a value.
        biases = [self._noises[path].bias / sqrt(3) for path in offsets]
        mean = np.array([*first, *(0.0 for _ in offsets)])
        self._belief = Belief(mean, np.diag([*unsure, *biases]))
        commands = len(self.model.command.schema.paths)
        rest = np.zeros(len(offsets) + commands)
        self._drift = np.diag(np.array([*drift, *rest]) ** 2)
        self._turns = Turns([one for _, one in schema.rows()]).extended(len(rest))
        sensed = dict(self.model.sensors.schema.rows()) if self._used else {}
        self._sensed = Turns([sensed[path] for path in self._used])
        self._old: list[float] = []
        self._past = Past(self._filtered)
        #: whether it is known where the robot is; and the tick of the newest picture
        self._placed, self._shot = True, -1
        self._warned: set[str] = set()

    def _numbers(
        self, schema: Schema, given: Mapping[str, Any], name: str
    ) -> list[float]:
        for path in given:
            field_of(schema, path, name)
        value = {
            path: parse_quantity(given[path], one.unit, f"{name} of {path!r}")
            for path, one in schema.rows()
            if path in given
        }
        default = schema({}).flat() if name == "initial" else {}
        return [value.get(path, default.get(path, 0.0)) for path in self._paths]

    def open(self) -> None:
        """Prepare to integrate many states at once. Raises ExperimentError."""
        for port, own in (("command", self.model.command), ("sensors", self._used)):
            has = self.__dict__.get(port, own)
            if lacks := [path for path in own if path not in has]:
                raise ExperimentError(
                    f"it reads {has.schema.name} as its {port}, which has no "
                    f"{lacks[0]!r}; connect it to the {port} of a "
                    f"{self.options.definition}. (R0881)"
                )
        self._motion = Motion(self.model, self._used)

    def step(self, tick: Tick) -> None:
        """Predict with the command, correct with sensors and pose, and publish."""
        readings = [float(self.sensors[path]) for path in self._used]
        # The same numbers again are an old reading.
        new = np.array(readings) if readings != self._old else None
        self._old, dt = readings, tick.dt
        command = np.array([*command_of(self.model, self.command).values()])
        self._belief = self._past.add(Span(tick.t, dt, dt, command, self._belief, new))
        if "pose" in runtime(self).sources:
            self._look(tick)
        self._publish()

    def _look(self, tick: Tick) -> None:
        """Put a new pose in at the time of its picture."""
        run, shot = runtime(self), self.pose.tick
        new = shot > self._shot
        if new and not self._poses.can_be(self.pose):
            if shot:  # or nothing has come yet
                self._warn("covariance", _NO_COVARIANCE)
        elif new:
            at = time_of(shot, run.dt)
            belief = self._past.put(self._poses.read(self.pose), at)
            if belief is None:
                self._warn(
                    "old",
                    f"a pose is {tick.t - at:.1f} s old, and {KEPT:g} s are kept: such "
                    "poses are passed over. Is the camera's computer too slow?",
                )
            else:
                self._belief, self._shot = belief, shot
        # The estimate is not as old as its last picture: the commands are new.
        fresh = self._shot + round(self.options.bridge / run.dt)
        run.source_ticks["pose"] = min(tick.n, fresh) if self._placed else 0

    @property
    def _count(self) -> int:
        return len(self._paths) + len(self._offsets)

    def moments(self, values: Floats, less: Less) -> Moments:
        """Return the moments of values at the sigma points."""
        raise NotImplementedError

    def _filtered(self, span: Span) -> Belief:
        """Return the belief at the end of a span."""
        belief = span.before
        if self._placed:
            belief = self._predicted(span)
            if span.readings is not None:
                belief = self._corrected(belief, span.command, span.readings)
            belief = Belief(belief.mean[: self._count], belief.root[: self._count])
        return belief if span.seen is None else self._met(belief, span.seen)

    def _predicted(self, span: Span) -> Belief:
        (mean, root), command = span.before, span.command
        # Parts of a step have independent errors: together, that of the step.
        slip = self.options.slip * sqrt(span.step / span.dt) if span.dt else 0.0
        (n, k), m = root.shape, len(command)
        wide = np.zeros((n + m, k + m))
        wide[:n, :k], wide[n:, k:] = root, np.diag(slip * np.abs(command))
        spots = points(np.concatenate([mean, np.zeros(m)]), wide, self.alpha)
        moved = spots.copy()
        moved[:, : len(self._paths)] = self._motion.moved(spots, command, span.dt)
        found = self.moments(moved, self._turns.less)
        return Belief(*predicted(found, self._drift * span.dt))

    def _corrected(self, belief: Belief, command: Floats, readings: Floats) -> Belief:
        spots = points(*belief, self.alpha)
        values = self._motion.read(spots, command)
        first = len(self._paths)
        for i, column in enumerate(self._offsets):
            values[:, column] += spots[:, first + i]
        found = self.moments(values, self._sensed.less)
        noise = np.diag(
            [
                _variance(self._noises[path], float(value))
                for path, value in zip(self._used, found.mean, strict=True)
            ]
        )
        off = self._sensed.less(readings, found.mean)
        return Belief(*updated(*belief, found, off, noise))

    def _met(self, belief: Belief, seen: Seen) -> Belief:
        belief, away = self._poses.met(belief, seen, first=not self._placed)
        self._placed = True
        if away is not None:
            far, turn = float(hypot(*away[:2].tolist())), degrees(away[2])
            self._warn(
                "moved" if far < localise.JUMP else f"moved {self.tick.n}",
                f"the robot was {1e3 * far:.0f} mm and {turn:.0f} degrees from where "
                "its commands led: it was moved by hand, or its wheels slip more than "
                "`slip` and `drift` state",
            )
        return belief

    def _warn(self, kind: str, sentence: str) -> None:
        """Warn of each kind once."""
        if kind not in self._warned:
            self._warned.add(kind)
            warn(kind.split()[0], f"{self.key}: {sentence}", self.key, self.tick.n)

    def _publish(self) -> None:
        count = len(self._paths)
        mean = self._turns.wrapped(self._belief.mean)[:count].tolist()
        self.state.clip(dict(zip(self._paths, mean, strict=True)))
        covariance = product(self._belief.root, self._belief.root.T)[:count, :count]
        spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist()
        self.deviation = dict(zip(self._paths, spread, strict=True))
        upper = covariance[np.triu_indices(count)].tolist()
        pairs = self.covariance.schema.paths
        self.covariance = dict(zip(pairs, upper, strict=True))


_NO_COVARIANCE = (
    "a pose has no covariance, and such poses are passed over; write 3 x 3 numbers in "
    "m2, m rad and rad2, with variances above 0"
)


def _variance(noise: Noise, value: float) -> float:
    """Return the variance of a reading; a value that is rounded to a step has some."""
    return float(max(noise.spread(value) ** 2 + noise.step**2 / 12, LEAST))
