"""Subject: the robot under test, built anew for every check."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rems_net.agents import parts
from rems_net.agents.experiment.source.methods import built
from rems_net.agents.experiment.source.mistakes import check_class
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.robot import Definition, Driver, Robot
from rems_net.errors import ExperimentError

Settings = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Subject:
    """A definition, a driver, and their settings."""

    definition: type[Definition]
    driver: type[Driver]
    parameters: Settings = field(default_factory=dict)
    options: Settings = field(default_factory=dict)
    initial: Settings = field(default_factory=dict)
    folder: Path = Path()

    @classmethod
    def of(
        cls, definition: str | type, driver: str | type, folder: Path, **told: Settings
    ) -> "Subject":
        """Find both by name, as an experiment does. Raises ExperimentError."""
        found = parts.find("definition", definition, folder)
        done = parts.find("driver", driver, folder)
        for one, kind in ((found, "definition"), (done, "driver")):
            if issubclass(one, Definition) and issubclass(one, Driver):
                raise ExperimentError(
                    f"{one.__name__} is a definition and a driver in one class; an "
                    f"experiment takes the two apart. Give the {kind} alone, such as "
                    "'woodbot' and 'mujoco'. (R0912)"
                )
        assert issubclass(found, Definition)
        assert issubclass(done, Driver)
        return cls(found, done, **told, folder=folder)

    @property
    def title(self) -> str:
        """`Cart done by Kinematic`"""
        return f"{self.definition.__name__} done by {self.driver.__name__}"

    @property
    def driven(self) -> bool:
        """Whether it lives in wall time, as hardware does."""
        return not self.driver.lockstep

    def plan(self, name: str = "robot", **more: Settings) -> Plan:
        """Return the plan from which a process builds it; `more` adds settings."""
        return Plan(
            "robot",
            name,
            [self.definition, self.driver],
            options={**self.options, **more.get("options", {})},
            parameters={**self.parameters, **more.get("parameters", {})},
            initial={**self.initial, **more.get("initial", {})},
            folder=self.folder,
        )

    def make(self, name: str = "robot", **more: Settings) -> Robot:
        """Build and prepare one, not open yet. Raises RemsError, or what it raises."""
        plan = self.plan(name, **more)
        check_class(plan)
        robot = built(plan)
        assert isinstance(robot, Robot)
        return robot

    @contextmanager
    def opened(self, name: str = "robot", **more: Settings) -> Iterator[Robot]:
        """Yield an open robot; close it at the end, also after an error."""
        robot = self.make(name, **more)
        try:
            robot.open()
            yield robot
        finally:
            robot.close()

    def model(self) -> "Subject":
        """Return the same definition with the kinematic driver in fine steps.

        Raises RemsError if the definition has no mathematics for it.
        """
        kinematic = parts.find("driver", "kinematic", self.folder)
        assert issubclass(kinematic, Driver)
        fine = {"integrator": "rk4", "substeps": 4}
        model = replace(self, driver=kinematic, options=fine)
        model.make("model")
        return model
