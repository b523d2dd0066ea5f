"""Making: environments from experiments."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.file import load
from rems_net.arguments import taught
from rems_net.defdict import parse_quantity
from rems_net.defdict.expression import Value, compiled
from rems_net.errors import ExperimentError, RemsError, because, nearest
from rems_net.gym.direct import Direct
from rems_net.gym.env import Given, RobotEnv, Stage
from rems_net.gym.fabric import OnFabric
from rems_net.gym.offered import Ports, checked
from rems_net.gym.task import Drawn, Moment, Names, Task
from rems_net.gym.vector import AsColumns, AsEngines, AsStages, VectorRobots

if TYPE_CHECKING:
    from rems_net.gym.parallel import ParallelRobots

Keys = str | Sequence[str]
#: the methods of a task
METHODS = ("reward", "ends", "start")
#: Similarity above which another method is taken for a misspelt one.
ALIKE = 0.75


@taught(ExperimentError, done="ends=", terminated="ends=", duration="limit=")
def make(
    lab: Path | str | Experiment,
    *,
    act: Keys,
    observe: Keys,
    task: Task | type[Task] | None = None,
    reward: str = "",
    ends: str = "",
    start: Mapping[str, Any] | None = None,
    limit: float | str | None = None,
    normalise: bool = False,
    clip: bool = False,
    ticks: int = 0,
    out: Path | str | None = None,
    fabric: bool = False,
    vector: int | None = None,
    render_mode: None = None,
) -> Any:
    """Return an experiment as an environment of Gymnasium.

    lab: a file such as "lab.toml" or "lab.py", or an Experiment.
    act: keys of what is commanded, such as "robot/sim/command".
    observe: keys of the ports that are read.
    task: the reward, end and start, as a class; or, in its place, expressions with
    units: reward="before.x - x", ends="x > 1 m", start={"robot/sim.x": "-10..10 cm"}.
    limit: fabric time after which an episode is cut off; the experiment's duration if
    it has one.  normalise: numbers that have a range go from -1 to 1.
    clip: limit an action to its range; otherwise it is refused.
    ticks: of one step; 0 for as many as all agents need to step once.
    out: folder in which all episodes are recorded.
    fabric: run the agents in processes, on a fabric, as `rems run` does: for devices,
    and for people who watch.
    vector: return a VectorEnv of so many copies; by default, a single Env. Kinematic
    robots without noise are computed as arrays, others by threads. Raises
    ExperimentError.
    """
    lab = lab if isinstance(lab, Experiment) else load(lab)
    ports = checked(lab, _keys(act, "act"), _keys(observe, "observe"), here=not fabric)
    made = _task(task, reward, ends, start, ports)
    ticks = _ticks(ticks, ports.every)
    steps = _steps(limit, lab, ticks, bool(ends or task))
    given = Given(
        ports, made, steps=steps, normalise=normalise, clip=clip, seed=lab.seed
    )
    if vector is not None:
        return _many(vector, lab, ports, given, ticks, out, fabric)
    return _env(lab, ports, given, ticks, out, fabric)


def _many(
    count: int,
    lab: Experiment,
    ports: Ports,
    given: Given,
    ticks: int,
    out: Path | str | None,
    fabric: bool,
) -> VectorRobots:
    """Return many copies: as columns if they are kinematic robots, alone and exact."""
    if type(count) is not int or count < 1 or out is not None or fabric:
        raise ExperimentError(
            f"vector is {count!r}, with out={out!r} and fabric={fabric}; expected a "
            "whole number from 1, and neither of the others: they are for one "
            "environment. (R0929)"
        )
    robot, *others = lab.check().values()
    alone = not others and [*ports.act] == [f"{robot.key}/command"]
    if alone and AsColumns.fit(robot, ticks * lab.dt):
        columns = AsColumns(robot, [*ports.observe], count, lab.dt, ticks)
        return VectorRobots(given, count, columns)
    kind = AsEngines if alone and AsEngines.fit(robot) else AsStages
    several = kind(lambda: Direct(lab, ports, ticks), given, count)
    return VectorRobots(given, count, several)


def _env(
    lab: Experiment,
    ports: Ports,
    given: Given,
    ticks: int,
    out: Path | str | None,
    fabric: bool,
) -> RobotEnv:
    kind: type[Stage] = OnFabric if fabric else Direct
    return RobotEnv(given, lambda record: kind(lab, ports, ticks, record or out))


@taught(ExperimentError)
def make_parallel(
    lab: Path | str | Experiment,
    *,
    act: Mapping[str, Keys],
    observe: Mapping[str, Keys],
    task: Mapping[str, Task] | None = None,
    reward: Mapping[str, str] | None = None,
    ends: Mapping[str, str] | None = None,
    start: Mapping[str, Any] | None = None,
    limit: float | str | None = None,
    normalise: bool = False,
    clip: bool = False,
    ticks: int = 0,
    out: Path | str | None = None,
    fabric: bool = False,
) -> "ParallelRobots":
    """Return an experiment as a parallel environment of PettingZoo.

    act, observe, task, reward, ends: those of each agent, by its name; the rest is as
    in `make`. The start is drawn from `start`, or by the first agent's task.
    """
    # Imported here: it needs PettingZoo.
    from rems_net.gym.parallel import parallel

    lab = lab if isinstance(lab, Experiment) else load(lab)
    words: tuple[Any, ...] = (act, observe, reward, ends)
    for word, given in zip(("act", "observe", "reward", "ends"), words, strict=True):
        if not isinstance(given or {}, Mapping) or not {*(given or {})} <= {*act}:
            raise ExperimentError(
                f"{word} is {given!r:.60}; expected one for each agent by its name, "
                f"such as {word}={{'a': ...}}, of the agents of act. (R0926)"
            )
    if {*act} != {*observe} or not act:
        raise ExperimentError(
            f"act is of {', '.join(act)} and observe of {', '.join(observe)}; expected "
            "both of the same agents. (R0926)"
        )
    acts = {name: _keys(keys, f"act of {name}") for name, keys in act.items()}
    looks = {name: _keys(observe[name], f"observe of {name}") for name in act}
    every = _keys([key for keys in acts.values() for key in keys], "act")
    seen = [*dict.fromkeys(key for keys in looks.values() for key in keys)]
    ports = checked(lab, every, seen, here=not fabric)
    ticks = _ticks(ticks, ports.every)
    common: Any = {
        "steps": _steps(limit, lab, ticks, bool(ends or task)),
        "clip": clip,
        "seed": lab.seed,
    }
    each: dict[str, Given] = {}
    for name in act:
        mine = ports._replace(
            act={key: ports.act[key] for key in acts[name]},
            observe={key: ports.observe[key] for key in looks[name]},
        )
        tasks = (task or {}).get(name), (reward or {}).get(name, "")
        made = _task(*tasks, (ends or {}).get(name, ""), None, mine)
        each[name] = Given(mine, made, normalise=normalise, **common)
    begins = (
        next(iter(each.values())).task if task else Drawn(start or {}, ports.starts)
    )
    whole = Given(ports, begins, normalise=False, **common)
    return parallel(each, _env(lab, ports, whole, ticks, out, fabric))


def woodbot(**settings: Any) -> Any:
    """Return a kinematic Woodbot that drives to 0.25 m ahead within 10 s."""
    lab = Experiment("woodbot", dt="50 ms")
    lab.robot("sim", "woodbot", "kinematic")
    usual: dict[str, Any] = {
        "act": "robot/sim/command",
        "observe": "robot/sim/state",
        "reward": "hypot(before.x - 25 cm, before.y) - hypot(x - 25 cm, y)",
        "ends": "hypot(x - 25 cm, y) < 2 cm",
        "limit": "10 s",
        "normalise": True,
    }
    return make(lab, **{**usual, **settings})


def _keys(given: Keys, what: str) -> list[str]:
    keys: list[Any] = [*given] if isinstance(given, list | tuple) else [given]
    named = keys and all(isinstance(key, str) for key in keys)
    if named and len({*keys}) == len(keys):
        return keys
    raise ExperimentError(
        f"{what} is {given!r:.80}; expected a key or a list of different keys, such as "
        "'robot/sim/state'. (R0926)"
    )


class Written(Drawn):
    """A task of expressions."""

    def __init__(self, reward: str, ends: str, start: Mapping[str, Any], ports: Ports):
        super().__init__(start, ports.starts)
        names = Names({**ports.observe, **ports.act})
        self._reward = _compiled(reward, names, "reward") if reward else None
        self._ends = _compiled(ends, names, "ends") if ends else None

    def reward(self, now: Moment, before: Moment) -> Any:
        """Return the value of the expression, in SI units."""
        return self._reward(now, before) if self._reward else 0.0

    def ends(self, now: Moment) -> Any:
        """Return the value of the expression."""
        return self._ends(now, now) if self._ends else False


def _compiled(text: str, names: Names, what: str) -> Value:
    try:
        made = compiled(text, names)
        if what == "ends" and not made.truth:
            raise ExperimentError("it is a number, neither true nor false (R0925)")
        return made.value
    except RemsError as error:
        raise ExperimentError(
            f"{what} is {text!r:.80}: {because(error)} Expected such as "
            "'x > 1 m' or 'before.x - x'. (R0925)"
        ) from None


def _task(
    task: Task | type[Task] | None,
    reward: str,
    ends: str,
    start: Mapping[str, Any] | None,
    ports: Ports,
) -> Task:
    if task is not None:
        made = task() if isinstance(task, type) else task
        if reward or ends or start or not isinstance(made, Task):
            raise ExperimentError(
                f"task is {task!r:.60}; expected a class below rems_net.gym.Task, and "
                "reward, ends and start as its methods. (R0926)"
            )
        own = vars(type(made))
        lacks = [name for name in METHODS if name not in own]
        for name in own:
            if not hasattr(Task, name) and (hint := nearest(name, lacks, ALIKE)):
                raise ExperimentError(
                    f"{type(made).__name__} has a method {name!r}, which an "
                    f"environment does not call.{hint} (R0926)"
                )
        return made
    if reward or ends:
        return Written(reward, ends, start or {}, ports)
    return Drawn(start or {}, ports.starts)


def _ticks(given: int, every: int) -> int:
    if type(given) is not int or given < 0 or given % every:
        raise ExperimentError(
            f"ticks is {given!r}; expected a number of ticks in which every agent has "
            f"stepped: {every}, or a multiple. (R0926)"
        )
    return given or every


def _steps(limit: float | str | None, lab: Experiment, ticks: int, ends: bool) -> int:
    """Return the steps of an episode; 0 if only the task ends it."""
    seconds = lab.duration if limit is None else parse_quantity(limit, "s", "limit")
    if seconds is None:
        if ends:
            return 0
        raise ExperimentError(
            "no episode would end: write ends='x > 1 m' or limit='10 s', or give the "
            "experiment a duration. (R0920)"
        )
    steps = round(seconds / (lab.dt * ticks))
    if steps < 1:
        raise ExperimentError(
            f"limit is {seconds:g} s, less than one step of {lab.dt * ticks:g} s. "
            "(R0920)"
        )
    return steps
