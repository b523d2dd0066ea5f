"""Connections: the sources of every In, checked before anything starts.

Commands of an input that are known beforehand are checked against their reader, too.
"""

import re
from collections.abc import Iterable, Mapping, Sequence

from rems_net.agents.about.wiring import Entry, Written, resolve
from rems_net.agents.agent import Agent, Input
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.robot import takes_commands
from rems_net.agents.rules import Rules, connect, shared
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import Verbs
from rems_net.defdict import Converter, Schema
from rems_net.errors import ExperimentError, RemsError, nearest, some, uncoded

#: a port that is read, the key of the In, the conversion of its values, and the rules
#: for that
Link = tuple[Written, str, Converter, Rules]

#: Number of lines, or ranges of lines, that are named.
NAMED = 6


def written(agents: Mapping[str, Agent]) -> dict[str, Entry]:
    """Return the ports of each agent, as a roster will list them."""
    return {key: Entry.of(agent) for key, agent in agents.items()}


def check_connections(
    agent: Agent,
    sources: Mapping[str, str],
    entries: Mapping[str, Entry],
    agents: Mapping[str, Agent],
) -> list[Link]:
    """Find the sources of every In of `agent`, and settle or convert its schema.

    sources: by In, its source. Raises ExperimentError or ConversionError.
    """
    links: list[Link] = []
    own, rules = agent.schemas(), runtime(agent).rules
    for port, reads in agent.ins().items():
        several = [one for of, one in sources.items() if of.startswith(f"{port}/")]
        if several:
            links += _check_shares(agent, port, several, entries, agents)
            continue
        source = sources.get(port)
        if source is None:
            if not (reads.optional or (port == "command" and takes_commands(agent))):
                raise ExperimentError(
                    f"its In {port!r} is connected to nothing; write what it "
                    f"reads, such as {port}='robot/sim/state'. (R0418)"
                )
            continue
        many = "*" in source
        found = resolve(source, entries, f"{agent.key}.{port}", agent.key)
        if port not in own:
            if many:
                continue
            own[port] = _schema(found[0], agents)  # it has one source
            agent.settle(port, own[port])
        if len(found) > 1:
            keys = [one.key for one in found]
            instead = ", or leave the schema out: In() takes all that match"
            raise ExperimentError(
                f"its In {port!r} has a schema, so it reads one port, and {source!r} "
                f"matches {len(found)}: {some(keys, 4)}. Name one of them"
                f"{'' if agent.kind == 'robot' else instead}. (R0419)"
            )
        for one in found:
            theirs, reader = _schema(one, agents), f"{agent.key}/{port}"
            convert = connect(theirs, own[port], rules, one.key, reader)
            links.append((one, reader, convert, rules))
    return links


def _check_shares(
    agent: Agent,
    port: str,
    sources: Sequence[str],
    entries: Mapping[str, Entry],
    agents: Mapping[str, Agent],
) -> list[Link]:
    """Refuse writers of one command that share a field, or write none of its fields."""
    links: list[Link] = []
    giver: dict[str, str] = {}
    own, rules = agent.schemas()[port], runtime(agent).rules
    reader = f"{agent.key}/{port}"
    for source in sources:
        (one,) = resolve(source, entries, reader, agent.key)
        theirs = _schema(one, agents)
        part = shared(own, theirs, rules, reader, one.key)
        for path in part.paths:
            if path in giver:
                raise ExperimentError(
                    f"{giver[path]} and {one.key} both write {path!r} of its command; "
                    "a field has one writer: leave it out of the schema of one, or let "
                    "a process choose. (R0420)"
                )
            giver[path] = one.key
        convert = connect(theirs, part, rules, one.key, reader)
        links.append((one, reader, convert, rules))
    for one, *_ in links:  # a slip would leave its field safe for ever
        for path in {*_schema(one, agents).paths} - {*own.paths}:
            # Other digits are another joint, and no slip.
            free = [
                known
                for known in own.paths
                if known not in giver and _letters(known) != _letters(path)
            ]
            if hint := nearest(path, free, 0.85):
                raise ExperimentError(
                    f"{one.key} writes {path!r}, which {reader} does not have.{hint}"
                    " (R0421)"
                )
    return links


def _letters(path: str) -> str:
    return re.sub(r"\d+", "0", path)


def connect_verbs(
    agent: Agent, sources: Mapping[str, str], entries: Mapping[str, Entry]
) -> dict[str, list[str]]:
    """Return, by robot, the ports at which the agent calls its verbs.

    sources: of its Ins. Raises ExperimentError for an In that reads something else than
    robots.
    """
    found: dict[str, list[str]] = {}
    for name, port in agent.ports().items():
        if not isinstance(port, Verbs):
            continue
        reads = port.reads.name
        if agent.kind != "process" or agent.ports().get(reads) is not port.reads:
            raise ExperimentError(
                f"{port.owner}.{name} has the verbs of what {port.owner}.{reads} "
                "reads; a process calls the verbs of robots that it reads itself."
                " (R0424)"
            )
        for one in resolve(sources[reads], entries, f"{agent.key}.{reads}", agent.key):
            if one.entry.kind != "robot":
                raise ExperimentError(
                    f"{name} = Verbs({reads}) calls the verbs of robots, and {reads} "
                    f"reads {one.key}; connect it to a robot, such as "
                    f"{reads}='robot/sim/state'. (R0424)"
                )
            found.setdefault(one.entry.key, []).append(f"{agent.key}/{name}")
    return found


def _schema(source: Written, agents: Mapping[str, Agent]) -> Schema:
    return agents[source.entry.key].schemas()[source.port]


def check_hands(agents: Mapping[str, Agent]) -> None:
    """Refuse inputs that people move, in a run as fast as it can be."""
    for key, agent in agents.items():
        if isinstance(agent, Input) and agent.by_hand:
            raise ExperimentError(
                f"{key} is moved by a person, and this run is as fast as it can be; "
                "give it a pace: pace = 1, or rems run lab.toml --pace 1 (R0433)"
            )


def check_foreseen(links: Iterable[Link], agents: Mapping[str, Agent]) -> None:
    """Refuse input values that their reader would drop.

    Raises ExperimentError with the lines of the input's file.
    """
    done: set[tuple[str, str, Rules]] = set()
    for one, reader, convert, rules in links:
        writer = agents[one.entry.key]
        # A swarm has one schema, and its rows are checked once.
        known = (one.key, convert.target.digest, rules)
        if isinstance(writer, Input) and known not in done:
            done.add(known)
            with origin(f"input {writer.name!r}"):
                _check(writer, reader, convert)


def _check(writer: Input, reader: str, convert: Converter) -> None:
    wrong: list[int] = []
    first: RemsError | None = None
    for line, values in writer.foreseen():
        try:
            convert(values)
        except RemsError as error:
            first = first or error
            wrong.append(line)
    if first is not None:
        file = writer.file()
        where = "line" if len(wrong) == 1 else "lines"
        raise ExperimentError(
            f"{file.name if file else writer.key}, {where} {shown(wrong)}: {reader} "
            f"would not take what is there, such as: {uncoded(first)} (R0421)"
        )


def shown(lines: Sequence[int]) -> str:
    """Return `2, 4 to 9 and 12`, and how many more beyond NAMED ranges."""
    runs: list[list[int]] = []
    for line in lines:
        if runs and runs[-1][1] == line - 1:
            runs[-1][1] = line
        else:
            runs.append([line, line])
    words = [f"{a}" if a == b else f"{a} to {b}" for a, b in runs[:NAMED]]
    if len(runs) > NAMED:
        rest = sum(b - a + 1 for a, b in runs[NAMED:])
        words.append(f"{rest} more")
    return ", ".join(words[:-1]) + " and " * (len(words) > 1) + words[-1]
