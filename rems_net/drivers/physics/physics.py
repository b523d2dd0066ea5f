"""Physics: the common part of the drivers of physics engines.

Every engine gets the same `Body`, moves it, and returns its pose; steps, state and
sensors are computed here, the same way for all engines.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from rems_net.agents.ports import Settings
from rems_net.agents.tick import Tick
from rems_net.bodies import sensors
from rems_net.bodies.body import Arena, Body, Embodied, Hinge, Joint, lump
from rems_net.bodies.files.built import built
from rems_net.defdict import DefDict, Field, time
from rems_net.drivers.needs import BODY, NEEDS_MUJOCO, field_of, missing
from rems_net.drivers.noise import NOISE, Simulated
from rems_net.drivers.physics.engine import Engine
from rems_net.drivers.physics.member import Member
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.world import PhysicsWorld
from rems_net.errors import SchemaError
from rems_net.libraries import look_for
from rems_net.scenes import marking
from rems_net.scenes.outline import check_places
from rems_net.scenes.scene import Scene

#: rad or m. A command's range may exceed the stops in a file by this: rounding.
SLACK = 1e-3


class Physics(Simulated):
    """Base of physics drivers: moves a `body()` in its `arena()`, or on an open floor.

    A step of the clock is cut into the fewest equal steps of at most `physics_step`.
    The state needs x and y in m and a heading in rad, which goes on past a full turn.
    A fixed body does not need these; without them, `initial` has its pose.
    A reset puts the world back without building it: the next run is the same to the
    last bit.
    """

    options = Settings(
        NOISE,
        physics_step=time(
            "s", default=0.001, range=(1e-5, 0.005), doc="of the engine, at most"
        ),
    )

    #: the robot in its world, and the world
    _member: Member | None = None
    _world: PhysicsWorld

    def build(self, bodies: Sequence[Body], scene: Scene) -> Engine:
        """Return the engine's world, with all bodies far apart, heading along +x."""
        raise NotImplementedError(f"{type(self).__name__} must define build().")

    def prepare(self) -> None:
        """Check the engine, and that the definition's body and fields fit."""
        for library in self.needs:
            look_for(library, library)
        if not isinstance(self, Embodied):
            raise missing(self, "body()", "what the robot is made of", BODY)
        body = built(self.body(), self.needs)
        if self.marked:
            marker = marking.of_robot(self, self.marked)
            own = marking.read(marker, body.height)
            body = replace(body, markers=(*body.markers, own))
        arena: Arena = getattr(self, "arena", Arena)()
        scene = Scene(tuple(arena.walls()), radius=arena.radius)
        self._member = member = Member(self, body)
        links = (link.joint.parts for link in member.tree.links)
        for parts in (body.parts, *links) if body.source is None else ():
            lump(parts)  # raises an error if the mass is 0
        step = float(self.options["physics_step"])
        self._world = PhysicsWorld(self.build, [self._member], scene, step)
        super().prepare()
        units: dict[tuple[str, str], str] = {}
        for port, path, unit in _told_and_heard(member):
            units.setdefault((port, path), unit)
        for (port, path), unit in units.items():
            self._check(port, path, unit)
        for camera in cameras([body]):
            self._check_picture(camera)
            self.look_for_renderer()
        if body.source is not None:
            self._check_stops(body.source.path.name)

    def _check_stops(self, file: str) -> None:
        """Raise SchemaError for a command's range beyond the stops in the file."""
        for link in self.member.tree.links:
            joint, stops = link.joint, link.joint.limits
            if joint.servo is None or stops is None or joint.ratio != 1.0:
                continue
            asked = getattr(self.command.schema[joint.obeys], "range", None)
            if asked and (asked[0] < stops[0] - SLACK or asked[1] > stops[1] + SLACK):
                low, high = (round(stop, 4) for stop in stops)
                raise SchemaError(
                    f"{type(self).__name__}: command {joint.obeys!r} goes from "
                    f"{asked[0]:g} to {asked[1]:g}, and joint {joint.name!r} of {file} "
                    f"from {low:g} to {high:g}: write range=({low:g}, "
                    f"{high:g}). (R0307)"
                )

    def _check(self, port: str, path: str, unit: str) -> None:
        """Raise SchemaError for a field that is missing, or in another unit."""
        found = field_of(self, "the body needs", port, path).unit
        if found != unit:
            raise SchemaError(
                f"{type(self).__name__}: physics needs {port} {path!r} in {unit!r}, "
                f"and it is in {found!r}. Give the field that unit. (R0306)"
            )

    def _check_picture(self, camera: sensors.Camera) -> None:
        """Raise SchemaError for a field that cannot hold the camera's picture."""
        schema = self.schemas()["sensors"]
        field = schema[camera.name]
        if not isinstance(field, Field) or (field.dtype, field.shape) != (
            "u1",
            camera.shape,
        ):
            raise SchemaError(
                f"{type(self).__name__}: the camera {camera.name!r} needs a field for "
                f"its picture; write in {schema.name}: "
                f'"{camera.name}": array({camera.shape}, dtype="u1") (R0306)'
            )

    def look_for_renderer(self) -> None:
        """Raise MissingPartError if this engine cannot draw cameras' pictures here."""

    def open(self) -> None:
        """Build the world, and let the body come to rest at its initial pose."""
        super().open()
        self._world.open()

    def close(self) -> None:
        """Close the world."""
        self._world.close()
        super().close()

    def drive(self, command: DefDict, dt: float) -> None:
        """Advance the physics by `dt` seconds, with the motors at the command."""
        self._world.drive([self.member.targets(command)], dt)

    def stepping(self, tick: Tick) -> Iterator[Callable[[], None]]:
        """Do `step`. Yields the engine's calculations, see `PhysicsWorld.driving`."""
        self.obey(tick)
        targets = self.member.targets(self.acting(tick.dt))
        yield from self._world.driving([targets], tick.dt)
        self.sense()

    def sense(self) -> None:
        """Read position and sensors from the world."""
        self.member.sense()
        self.add_noise()

    @classmethod
    def share(cls, robots: "Sequence[Physics]", scene: Scene) -> PhysicsWorld:
        """Return one world of the engine, with all these robots."""
        steps = [float(robot.options["physics_step"]) for robot in robots]
        if min(steps) != max(steps):
            raise SchemaError(
                f"its robots have physics_step {min(steps):g} s and {max(steps):g} s; "
                "one world has one: give all of them the same. (R0307)"
            )
        if scene.mjcf and "mujoco" not in cls.needs:
            raise SchemaError(NEEDS_MUJOCO)
        outlines = [robot.member.outline for robot in robots]
        places = [robot.member.where() for robot in robots]
        check_places([robot.key for robot in robots], outlines, places, scene)
        members = [robot.member for robot in robots]
        world = PhysicsWorld(robots[0].build, members, scene, steps[0])
        for robot in robots:
            robot._world = world
        return world

    @property
    def member(self) -> Member:
        """The robot in its world; available after `prepare`."""
        assert self._member is not None
        return self._member


def _told_and_heard(member: Member) -> Iterator[tuple[str, str, str]]:
    """Yield port, path and unit of every field that physics reads or writes."""
    body, tree = member.body, member.tree
    if member.posed:
        yield from (("state", path, "m") for path in ("x", "y"))
        yield "state", "heading", "rad"
    # A field that several joints obey has the unit of a joint with ratio 1.
    for link in sorted(tree.links, key=lambda link: link.joint.ratio != 1.0):
        joint, unit = link.joint, _unit(link.joint)
        if joint.effort:
            yield "command", joint.obeys, unit if joint.servo else f"{unit}/s"
        if joint.servo and joint.servo.share:
            yield "command", joint.servo.share, "ratio"
        if joint.position:
            yield "state", joint.position, unit
    for sensor in body.sensors:
        match sensor:
            case sensors.Ray():
                unit = "m"
            case sensors.Gyro():
                unit = "rad/s"
            case sensors.Accelerometer():
                unit = "m/s**2"
            case sensors.Encoder(_, name):
                unit = _unit(tree.links[tree.number(name)].joint)
            case sensors.Tachometer(_, name):
                unit = f"{_unit(tree.links[tree.number(name)].joint)}/s"
            case sensors.Compass() | sensors.Switch() | sensors.Camera():
                unit = ""
        yield "sensors", sensor.name, unit


def _unit(joint: Joint) -> str:
    return "rad" if isinstance(joint, Hinge) else "m"
