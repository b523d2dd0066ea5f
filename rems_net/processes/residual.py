"""Residual: learns, while a robot drives, what its definition leaves over."""

from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from rems_net.agents.agent import Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.robot import definition_of
from rems_net.agents.tick import Tick
from rems_net.defdict import (
    Schema,
    angle,
    array,
    boolean,
    integer,
    length,
    number,
    text,
    time,
)
from rems_net.drivers.kinematic.correction import (
    RUNAWAY,
    Memory,
    Network,
    Weights,
    go,
    local,
    pose,
    probe,
    runs_away,
)
from rems_net.drivers.kinematic.model import POSE
from rems_net.errors import ExperimentError
from rems_net.events import warn
from rems_net.processes.gate import Gate
from rems_net.processes.learner import Learner, train
from rems_net.processes.model import command_of, model_of

#: Share of full speed. A step that is so far from the prediction was no drive: somebody
#: has lifted the robot, or its pose was lost.
JOLT = 3.0
#: Share by which a new error changes the skill over one step: the last 50 count.
RATE = 0.02


class Residual(Process):
    """Learns what a definition leaves over of a robot's motion, in one pass.

    At each tick the definition predicts the step from the robot's own pose. A network
    predicts the rest; then an unscented Kalman filter tunes its weights. `correction`
    is 0 while it does not help: `skill` is measured before it learns. If `save` names
    a file, it has the weights in the end, for a kinematic robot's `correction`.
    """

    options = Settings(
        definition=text(doc="of the robot: woodbot, or my.py:Cart"),
        parameters=text(max_len=4096, doc='of it: track = "100 mm", or a file'),
        hidden=integer(default=4, range=(1, 10_000), doc="neurons"),
        memory=time(default=0.3, range=(0, 10), doc="how long it knows commands"),
        taps=integer(default=3, range=(1, 100), doc="spans of it, whose means count"),
        due=integer(range=(0, 10_000), doc="if not 0: learns in jobs of so many ticks"),
        save=text(doc="file of the weights, among the results"),
    )
    command = In()
    state = In()
    correction = Out(
        Schema(
            "residual.correction",
            {
                "x": length(doc="ahead, in this step"),
                "y": length(doc="to the left"),
                "heading": angle(doc="counter-clockwise"),
                "helps": boolean(doc="whether the gate is open; if not, all are 0"),
            },
        )
    )
    skill = Out(
        Schema(
            "residual.skill",
            {
                **{
                    name: number(
                        doc="share of a step's square error that it takes away"
                    )
                    for name in POSE
                },
                "second": {
                    "alone": length(doc="RMS error after 1 s; 0 at first"),
                    "corrected": length(doc="the same, with the corrections"),
                },
                "long": {
                    "alone": length(doc="RMS error after 10 s; 0 at first"),
                    "corrected": length(doc="the same, with the corrections"),
                },
            },
        )
    )
    weights = Out()

    def prepare(self) -> None:
        """Build the definition, which predicts. Raises ExperimentError."""
        super().prepare()
        options = self.options
        self.model = robot = model_of(self)
        lacks = [field for field in POSE if field not in robot.state]
        if lacks:
            raise ExperimentError(
                f"the state of a {options.definition} has no {lacks[0]!r}; a residual "
                "corrects x, y and heading of a robot that drives. (R0873)"
            )
        commands = robot.command.schema.paths
        self.network = Network(options.taps * len(commands), options.hidden)
        fields = {"values": array(self.network.count, doc="of the network")}
        self.settle("weights", Schema("residual.weights", fields))

    def open(self) -> None:
        """Begin with a network that corrects nothing."""
        seed = self.random.getrandbits(64)
        self.learner = Learner(self.network, np.random.default_rng(seed))
        self._before: tuple[float, ...] | None = None
        self._errors = np.zeros((2, len(POSE)))
        self._samples: list[Any] = []
        self._off = self._asked = False
        self._gate: Gate | None = None

    def step(self, tick: Tick) -> None:
        """Compare the step with its predictions, then learn from it."""
        if self._gate is None:
            self._begin(tick.dt)
        given = self.memory.add(command_of(self.model, self.command))
        before, now = self._before, pose(self.state)
        self._before = now
        if before is not None and not self._off:
            self._take(given, before, now, tick.dt)
            if not np.isfinite(self.learner.mean).all():
                self._stop()
        self.weights = {"values": self.learner.mean}

    def close(self) -> None:
        """Save the weights; an engine that has no folder for results saves none."""
        name, gate = self.options.save, getattr(self, "_gate", None)
        if name and gate is not None and self.out != Path():
            self.saved().write(self.out / name)

    def saved(self) -> Weights:
        """Return the weights as they are now, for a file."""
        assert self._gate is not None
        return Weights(
            definition_of(type(self.model)).__name__,
            [*self.model.command.schema.paths],
            self._step,
            self.options.taps,
            self._width,
            self.options.hidden,
            self._full.tolist(),
            self._probe,
            self._gate.open and not self._off,
            self.learner.mean.tolist(),
        )

    def _begin(self, step: float) -> None:
        full, self._probe = probe(self.model, step)
        self._step, self._full, self._gate = step, np.array(full), Gate(step)
        taps = self.options.taps
        self._width = max(1, round(self.options.memory / taps / step))
        self.memory = Memory(self.model.command.schema, taps, self._width)

    def _take(
        self, given: Any, before: tuple[float, ...], now: tuple[float, ...], dt: float
    ) -> None:
        assert self._gate is not None
        real = np.array(local(before, now))
        real[2] -= 2 * pi * round(real[2] / (2 * pi))  # a heading may be wrapped
        alone = self._predict(before, dt)
        read, said = (real - alone) / self._full, self.learner.predict(given)
        if np.abs(read).max() > JOLT:
            self._gate.restart()
            return
        if runs_away(said):
            self._stop()
            return
        step = said * self._full
        self._gate.add(real.tolist(), alone.tolist(), (alone + step).tolist())
        self._errors += RATE * (np.array([read, read - said]) ** 2 - self._errors)
        self._show(step)
        self._learn(given, read)

    def _predict(self, before: tuple[float, ...], dt: float) -> Any:
        """Return the step that the definition alone would do: m, m, rad."""
        model = self.model
        model.state = {
            path: self.state[path] for path in model.state if path in self.state
        } | dict(zip(POSE, before, strict=True))
        go(model, command_of(model, self.command), dt)
        return np.array(local(before, pose(model.state)))

    def _learn(self, given: Any, read: Any) -> None:
        """Learn in the step, or in a job whose result is due in a fixed step."""
        if not self.options.due:
            self.learner.learn(given, read)
            return
        self._samples.append((given, read))
        if not self._asked and len(self._samples) >= self.options.due:
            self.jobs.submit(
                train,
                self.learner,
                self._samples,
                then=self._taught,
                process=True,
                due=self.options.due,
            )
            self._asked, self._samples = True, []

    def _taught(self, learner: Learner) -> None:
        self.learner, self._asked = learner, False

    def _show(self, step: Any) -> None:
        assert self._gate is not None
        helps = self._gate.open
        used = step.tolist() if helps else [0.0] * len(POSE)
        self.correction = {**dict(zip(POSE, used, strict=True)), "helps": helps}
        alone, corrected = self._errors
        share = 1.0 - corrected / np.maximum(alone, 1e-300)
        error = self._gate.error
        self.skill = {
            **dict(zip(POSE, share.tolist(), strict=True)),
            "second/alone": error(0, 0),
            "second/corrected": error(0, 1),
            "long/alone": error(-1, 0),
            "long/corrected": error(-1, 1),
        }

    def _stop(self) -> None:
        """Correct nothing from now on: the network has run away."""
        self._off = True
        self.learner.mean = np.zeros(self.network.count)
        self.correction = {**dict.fromkeys(POSE, 0.0), "helps": False}
        warn("correction", f"{self.key}: {RUNAWAY}", self.key)
