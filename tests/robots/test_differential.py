"""Robots on two sides of wheels: what their definitions say, and how each drives."""

from math import hypot, pi
from typing import Any

import pytest

from rems_net.agents.robot import Driver, Robot
from rems_net.bodies.actuators import GROUP, actuation
from rems_net.bodies.body import Box, Cylinder, Ray, Sphere, Tachometer, lump
from rems_net.defdict import Schema, percent
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.errors import FieldValueError, SchemaError
from rems_net.robots.create2 import Create2
from rems_net.robots.differential import FIGURES, Differential, figures
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.epuck import COUNTED, Epuck
from rems_net.robots.moose import Moose
from rems_net.robots.pioneer import Pioneer3AT, Pioneer3DX
from rems_net.robots.sensing import read, sensed
from rems_net.robots.skid_steered import SkidSteered
from tests.drivers.physics.test_physics import ENGINES
from tests.robots.moving import running
from tests.robots.skidding import skidding, touching

ROBOTS: list[type[Differential]] = [Create2, Dynabot, Epuck, Pioneer3DX]
ROBOTS += [Pioneer3AT, Moose]
every_robot = pytest.mark.parametrize("kind", ROBOTS, ids=lambda k: k.__name__)
every_engine = pytest.mark.parametrize("engine", ENGINES)


def now(robot: Robot) -> dict[str, float]:
    return {path: robot.state[path] for path in robot.state.schema.paths}


def go(robot: Robot, left: float, right: float, seconds: float) -> dict[str, float]:
    """Drive at these wheel speeds, rad/s; return by how much the state has changed."""
    before = now(robot)
    robot.command = {"wheel/left": left, "wheel/right": right}
    for _ in range(round(seconds / 0.05)):
        robot.drive(robot.command, 0.05)
    robot.sense()
    return {path: value - before[path] for path, value in now(robot).items()}


@every_robot
def test_every_figure_has_a_source(kind: type[Differential]) -> None:
    schema = kind.parameters.schema
    assert {"wheel_radius", "track", "max_wheel_speed", "mass"} <= set(schema.paths)
    motors = actuation("wheel/left", "wheel/right").prefix(GROUP).paths
    assert set(schema.paths) - set(motors) <= FIGURES.keys()
    assert set(motors) <= set(schema.paths)
    for path, field in zip(schema.paths, schema.fields, strict=True):
        assert field.doc, path


def test_a_figure_that_is_none_is_refused() -> None:
    with pytest.raises(SchemaError, match=r"no 'trak'.*Did you mean 'track'\?"):
        figures(trak=(0.1, "measured"))


def test_a_sensor_that_mathematics_cannot_read_is_refused() -> None:
    with pytest.raises(SchemaError, match=r"not by Tachometer.*measure\(\)"):
        sensed("cart.sensors", [Tachometer("speed", "wheel/left")], "measured")


@every_robot
def test_the_body_is_what_the_figures_say(kind: type[Differential]) -> None:
    robot = kind("r")
    robot.prepare()
    body, p = robot.body(), robot.parameters
    links = [(part, hinge.at) for hinge in body.joints for part in hinge.parts]
    whole = [(part, (0.0, 0.0, 0.0)) for part in body.parts] + links
    assert sum(part.mass for part, _ in whole) == pytest.approx(p.mass)
    assert all(part.mass > 0 for part, _ in whole)
    ahead = sum(part.mass * (at[0] + part.at[0]) for part, at in whole) / p.mass
    if "centre_of_mass" in p:
        assert ahead == pytest.approx(p.centre_of_mass)
    assert lump(body.parts).centre[1] == pytest.approx(0.0)
    # Nothing is below the floor, and the wheels touch it.
    lows = [at[2] + part.at[2] - _below(part.shape) for part, at in whole]
    assert min(lows) == pytest.approx(-body.height)
    assert body.height == p.wheel_radius
    assert [s.name for s in body.sensors] == list(kind.sensors.schema.paths)
    assert {hinge.command for hinge in body.joints} == set(robot.command.schema.paths)


@every_robot
def test_no_wheel_is_too_light_for_the_loop_of_its_motor(
    kind: type[Differential],
) -> None:
    """Or MuJoCo lets it slip at low speeds, by up to all that it drives."""
    hinge = kind("r").wheels()[0]
    inertia = lump(hinge.parts).inertia[1, 1] + hinge.armature
    assert hinge.effort / hinge.droop * 0.001 < 2.5 * inertia


def _below(shape: Box | Cylinder | Sphere) -> float:
    match shape:
        case Box(size):
            return size[2] / 2
        case Sphere(radius):
            return radius
        case Cylinder(radius, length, axis):
            return length / 2 if axis[2] else radius


@every_robot
def test_the_mathematics_of_rolling(kind: type[Differential]) -> None:
    with running(kind, Kinematic, options={"integrator": "rk4"}) as robot:
        p = robot.parameters
        track = p.effective_track if issubclass(kind, SkidSteered) else p.track
        moved = go(robot, 2.0, 2.0, 0.5)
        assert moved["x"] == pytest.approx(p.wheel_radius)
        assert moved["heading"] == 0.0
        assert moved["wheel/left"] == pytest.approx(1.0)
        assert moved["wheel/right"] == pytest.approx(1.0)
        moved = go(robot, -1.0, 1.0, 0.5)
        assert moved["heading"] == pytest.approx(p.wheel_radius / track)
        assert hypot(moved["x"], moved["y"]) < 1e-9
        assert robot.sensors["encoder/left"] == pytest.approx(0.5)
        assert robot.sensors["encoder/right"] == pytest.approx(1.5)
        with pytest.raises(FieldValueError, match="wheel/left"):
            robot.command = {"wheel/left": 1.001 * p.max_wheel_speed}


@every_robot
@every_engine
def test_physics_does_as_the_mathematics_in_slow_motion(
    kind: type[Differential], engine: type[Driver]
) -> None:
    assert isinstance(kind.tolerance, float)
    fine = {"integrator": "rk4"}
    with (
        running(kind, engine) as robot,
        running(kind, Kinematic, options=fine) as model,
    ):
        top = 0.05 * robot.parameters.max_wheel_speed
        path = robot.parameters.wheel_radius * top * 0.4
        for left, right in ((top, top), (-top, top), (0.5 * top, top)):
            robot.reset()
            go(robot, left, right, 0.8 * kind.eases)  # up to speed
            model.state = now(robot)
            real, ideal = go(robot, left, right, 0.4), go(model, left, right, 0.4)
            assert hypot(real["x"] - ideal["x"], real["y"] - ideal["y"]) < 0.05 * path
            assert real["heading"] == pytest.approx(
                ideal["heading"], rel=kind.tolerance, abs=2e-3
            )
            for side in ("wheel/left", "wheel/right"):
                assert real[side] == pytest.approx(ideal[side], abs=0.02 * top)
        for side in ("left", "right"):
            assert robot.sensors[f"encoder/{side}"] == robot.state[f"wheel/{side}"]


@every_robot
def test_one_input_drives_them_all(kind: type[Differential]) -> None:
    robot = kind("r")
    robot.prepare()
    fields = {"wheel/left": percent(), "wheel/right": percent()}
    convert = Schema("keys", fields).converter(robot.command.schema)
    told = convert({"wheel/left": 100, "wheel/right": -50})
    top = robot.parameters.max_wheel_speed
    assert told["wheel/left"] == top
    assert told["wheel/right"] == pytest.approx(-top / 2)


def test_what_skids() -> None:
    """Two axles have a closed form; more do not, and lie between their ends."""
    w, length = 0.394, 0.2662
    corners = [(length / 2, w / 2), (-length / 2, w / 2)]
    thin = w + length**2 / w
    assert skidding(corners) == pytest.approx(thin)
    at = Pioneer3AT("r")
    assert skidding(touching(at)) == pytest.approx(thin)
    assert at.parameters.effective_track == pytest.approx(thin, rel=0.03)
    moose = Moose("r")
    told = moose.parameters.effective_track
    assert told == pytest.approx(skidding(touching(moose)), abs=5e-4)


@pytest.mark.parametrize("kind", [Pioneer3AT, Moose])
def test_slaves_obey_the_first_axle(kind: type[SkidSteered]) -> None:
    hinges = kind("r").body().joints
    assert len(hinges) == 2 * len(kind.axles)
    assert len({hinge.name for hinge in hinges}) == len(hinges)
    first, slaves = hinges[:2], hinges[2:]
    assert [hinge.position for hinge in first] == ["wheel/left", "wheel/right"]
    assert all(not hinge.position for hinge in slaves)
    for hinge in hinges:
        assert hinge.command == ("wheel/left" if hinge.at[1] > 0 else "wheel/right")


@pytest.mark.parametrize("kind", [Pioneer3DX, Epuck])
def test_rays_agree_with_the_mathematics(kind: type[Differential]) -> None:
    radius = 3 * kind("r").parameters.track
    settings: dict[str, Any] = {
        "parameters": {"arena_radius": radius},
        "initial": {"x": 0.4 * radius, "y": 0.3 * radius, "heading": 0.7},
    }
    with (
        running(kind, Mujoco, **settings) as real,
        running(kind, Kinematic, **settings) as model,
    ):
        rays = [s for s in kind.senses if isinstance(s, Ray)]
        near = [r for r in rays if model.sensors[r.name] < r.reach]
        assert near
        for ray in rays:
            expected = model.sensors[ray.name]
            assert real.sensors[ray.name] == pytest.approx(expected, abs=2e-3 * radius)


@pytest.mark.parametrize("driver", [Kinematic, Mujoco])
def test_bumpers_and_cliffs_of_a_create(driver: type[Driver]) -> None:
    settings: dict[str, Any] = {"parameters": {"arena_radius": 0.6}}
    with running(Create2, driver, **settings) as robot:
        assert not any(
            v for p, v in _leaves(robot) if p.startswith(("bumper", "cliff"))
        )
        if driver is Kinematic:
            robot.state = {"x": 0.427, "heading": 0.3}
            robot.sense()
            pressed = robot.sensors["bumper/left"], robot.sensors["bumper/right"]
            assert pressed == (False, True)  # the wall is ahead and to the right
            return
        go(robot, 4.0, 4.0, 4.0)
        assert robot.state["x"] < 0.6 - 0.16
        assert robot.sensors["bumper/left"]
        assert robot.sensors["bumper/right"]


def test_a_cliff_is_a_floor_far_below() -> None:
    (cliff,) = (s for s in Create2.senses if s.name == "cliff/front_left")
    pose = 0.0, 0.0, 1.0, 0.0
    assert read(cliff, pose, 0.0, {}, height=0.036, radius=0.0) is False
    assert read(cliff, pose, 0.0, {}, height=0.100, radius=0.0) is True


def _leaves(robot: Robot) -> list[tuple[str, Any]]:
    return [(path, robot.sensors[path]) for path in robot.sensors.schema.paths]


def test_an_epuck_counts() -> None:
    convert = Epuck.sensors.schema.converter(COUNTED)
    far = {f"proximity/{number}": 0.07 for number in range(8)}
    counted = convert(
        Epuck.sensors.schema({**far, "proximity/0": 0.0, "proximity/7": 0.035})
    )
    assert counted["proximity/0"] == 4095
    assert counted["proximity/1"] == 67
    assert counted["proximity/7"] == pytest.approx((235 + 158) / 2, abs=1)


def test_the_compass_of_a_moose() -> None:
    with running(Moose, Kinematic, initial={"heading": pi / 2}) as robot:
        assert robot.sensors["compass/x"] == pytest.approx(1.0)
        assert robot.sensors["compass/y"] == pytest.approx(0.0)
        go(robot, -1.0, 1.0, 0.1)
        assert robot.sensors["gyro/z"] == pytest.approx(2 * 0.3175 / 1.612)
