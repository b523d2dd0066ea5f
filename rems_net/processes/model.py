"""Model: the robot that a process computes beside the one that it reads."""

from rems_net.agents.agent import Process
from rems_net.agents.parts import find
from rems_net.agents.robot import Definition, combine
from rems_net.bodies.noise import Noise
from rems_net.defdict import DefDict, parse_quantity
from rems_net.drivers.kinematic.correction import limits
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.noise import table
from rems_net.errors import ExperimentError
from rems_net.processes.fields import field_of, odd
from rems_net.recordings.parameters.identified import as_line, parameters_for


def model_of(process: Process) -> Kinematic:
    """Return a robot with the definition and the parameters of a process's options.

    If these come from a file, the noise in it is the robot's option.
    """
    name, given = process.options.definition, process.options.parameters
    if not name:
        raise ExperimentError(
            f"{process.key} needs the definition of the robot that it reads; write "
            'options={"definition": "woodbot"}. (R0881)'
        )
    found = find("definition", name, process.folder)
    assert issubclass(found, Definition)
    options = {}
    if given.endswith(".toml"):
        parameters, noise = parameters_for(process.folder / given, found)
        options["noises"] = as_line(noise)
    else:
        parameters = table(given, "parameters")
    robot = combine(found, Kinematic)(
        process.name, parameters=parameters, options=options, folder=process.folder
    )
    robot.prepare()
    assert isinstance(robot, Kinematic)
    robot.integration.told = "silent"  # the robot itself warns of long steps
    return robot


def command_of(robot: Kinematic, command: DefDict) -> dict[str, float]:
    """Return a robot's command for its model: the same shares of the limits."""
    ours, theirs = limits(robot.command.schema), limits(command.schema)
    return {p: float(command[p]) / theirs[p] * most for p, most in ours.items()}


def noises(process: Process, robot: Kinematic) -> dict[str, Noise]:
    """Return the noise of each sensor that has some; others are not used.

    Raises ExperimentError if there is none.
    """
    name, given = process.options.definition, table(process.options.noise, "noise")
    if robot.read is None:
        raise ExperimentError(
            f"{name} has no sensors, so nothing corrects an estimate; give its "
            "definition `sensors`, `measure` and `noise`. (R0881)"
        )
    stated = robot.noises()
    schema = robot.sensors.schema
    found: dict[str, Noise] = {}
    for glob, one in stated.items():
        found |= dict.fromkeys(schema.slice(glob).paths, one)
    for path, value in given.items():
        unit = field_of(schema, path, "noise").unit
        size = parse_quantity(value, unit, f"the noise of {path!r}")
        found[path] = Noise(absolute=size)
    computed = robot.read(robot.state, robot.command)
    usable = {
        path: found[path]
        for path, one in schema.rows()
        if found.get(path, Noise()) != Noise() and path in computed
        if not odd(one)
    }
    if not usable:
        raise ExperimentError(
            f"{name} does not state how noisy its sensors are, and no option does; "
            f"write such as options={{\"noise\": '{schema.paths[0]} = 0.01'}}. (R0881)"
        )
    return usable
