"""Model: the robot that a process computes beside the one that it reads."""

from rems_net.agents.agent import Process
from rems_net.agents.parts import find
from rems_net.agents.robot import Definition, combine
from rems_net.agents.table import table
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import ExperimentError
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
