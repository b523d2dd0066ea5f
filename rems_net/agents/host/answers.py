"""Answers of a host to questions about its keys: ports, fields, schemas, verbs."""

import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from hashlib import blake2b
from typing import Any

from rems_net.agents.about.scenery import scene_of
from rems_net.agents.about.standing import Standing
from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import where
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.host.leases import Leases
from rems_net.agents.host.outlet import CROWD, Outlet, Outlets
from rems_net.agents.protocol.messages import answer_call
from rems_net.agents.robot import Robot, definition_of
from rems_net.agents.runtime import Guard, runtime
from rems_net.defdict import Field
from rems_net.engine.engine import Engine
from rems_net.engine.inlet import Inlet
from rems_net.router.keys import ALL, agent_of
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session

#: s. A simulated robot counts as standing still after this time without a tick.
IDLE = 0.1


def topics(agents: Mapping[str, Agent]) -> list[str]:
    """Return the keys that a host answers: each agent's own, or one per kind.

    Zenoh compares every declaration with all others. A crowd is therefore asked for all
    agents of its kind; it ignores questions about those of other hosts.
    """
    if len(agents) <= CROWD:
        return list(agents)
    return sorted({f"{agent.kind}/*" for agent in agents.values()})


def asked(question: Question, agents: Mapping[str, Agent]) -> list[Agent]:
    """Return those of `agents` that a question may be for."""
    if question.topic in agents:
        return [agents[question.topic]]
    if "*" in question.key:
        kind = question.topic.partition("/")[0]
        return [agent for agent in agents.values() if agent.kind == kind]
    one = agents.get(agent_of(question.key))
    return [one] if one else []


class Answers:
    """Answers for the agents of one host, once it knows its ports."""

    def __init__(self, engine: Engine, key: Callable[..., str], leases: Leases):
        self._visits, self._agents = engine.visits, engine.agents
        self._key, self._leases = key, leases
        self._outlets: Outlets

    def declare(
        self,
        session: Session,
        inbox: Inbox,
        guard: Guard,
        inlets: Sequence[Inlet],
        outlets: Outlets,
    ) -> None:
        """Answer questions from now on: by `inbox`, or at once if no tick is needed."""
        self._outlets, agents, key = outlets, self._agents, self._key
        for kind in sorted({crowd.kind for crowd in outlets.crowds}):
            session.answer(key(kind, ALL, "*"), inbox.box, f"{kind}/{ALL}")
        for topic in topics(agents):
            session.answer(key(topic, "**"), inbox.box, topic)
            session.answer(key(topic, "@schema"), inbox.box, topic)
            session.answer(key(topic, "@call", "*"), inbox.box, topic)
            if topic.startswith(("robot/", "input/")):
                for way in ((), ("take",), ("drive",)):
                    session.answer(key(topic, "@lease", *way), inbox.box, topic)
        why = partial(tell_why, agents, inlets, self._leases, key)
        for topic in topics(agents):
            session.answer_at_once(key(topic, "@why"), why, topic)
        scene = partial(tell_scene, agents, key)
        for topic in topics(agents):
            if topic.startswith(("robot/", "world/")):
                session.answer_at_once(key(topic, "@scene"), scene, topic, apart=True)
        settings = partial(tell_settings, agents, key)
        for topic in topics(agents):
            session.answer_at_once(key(topic, "@settings"), settings, topic)
        # There is one main thread, so one answer: at its first agent's key.
        asks = partial(tell_where, inbox)
        session.answer_at_once(key(next(iter(agents)), "@where"), asks)
        receipt = partial(tell_stopped, agents, guard, inbox, key)
        session.answer_at_once(key("robot", "*", "@stopped"), receipt)
        driver = partial(tell_driver, self._leases, key)
        session.answer_at_once(key("*", "*", "@driver"), driver)

    def call(self, question: Question) -> None:
        """Call the verbs that a question names; an error goes to the caller."""
        name = question.key.split("/")[-1]
        with question:
            for agent in asked(question, self._agents):
                key = self._key(agent.key, "@call", name)
                if question.covers(key):
                    answer_call(question, key, self._visits.verbs(agent))

    def answer(self, question: Question) -> None:
        """Answer with every port that the question covers, or with fields of ports.

        `?format=json` gives values with units, for people and other languages;
        `?since=7` gives the values written since tick 7 that are still kept, for a
        reader that has not received them.
        """
        as_json = question.parameters.get("format") == "json"
        with question:
            if f"/{ALL}/" in question.key:
                self._answer_crowds(question)
                return
            agents = asked(question, self._agents)
            if question.key.endswith("/@schema"):
                for agent in agents:
                    key = self._key(agent.key, "@schema")
                    if question.covers(key):
                        published = agent.published().items()
                        schemas = {port: one.to_wire() for port, one in published}
                        question.answer(key, pack(schemas))
                return
            if "/@lease" in question.key:
                for agent in agents:
                    lease = self._key(agent.key, "@lease")
                    if question.key in (lease, f"{lease}/take", f"{lease}/drive"):
                        self._leases.answer(question, agent.key)
                return
            keys = {agent.key for agent in agents}
            for outlet in self._outlets.all:
                if outlet.agent.key in keys:
                    if question.covers(outlet.key):
                        _answer_port(question, outlet, as_json)
                    elif question.covers(f"{outlet.key}/**"):
                        _answer_fields(question, outlet, as_json)

    def _answer_crowds(self, question: Question) -> None:
        since = _since(question)
        for crowd in self._outlets.crowds:
            if since is not None and question.covers(crowd.key):
                for n, message, stamp in crowd.recent:
                    if n >= since:
                        question.answer(crowd.key, message, crowd.encoding, stamp)


def _answer_port(question: Question, outlet: Outlet, as_json: bool) -> None:
    value, time = outlet.value, outlet.run.tick.t
    if as_json:
        plain = {"tick": outlet.n, "time": time, "values": value.describe()}
        question.answer(outlet.key, json.dumps(plain).encode())
        return
    schema = f"{value.schema.name}@{outlet.digest}"
    since = _since(question)
    if since is not None:
        kept = {n: row for n, *row in outlet.recent if n >= since}
        for payload, stamp in kept.values():
            question.answer(outlet.key, payload, schema, stamp)
        if outlet.n in kept:  # a verb may have changed the agent since that tick
            return
    question.answer(outlet.key, value.encode(), schema, outlet.stamp(outlet.n, time))


def _since(question: Question) -> int | None:
    """Return the tick of `?since=7`; None without one."""
    text = question.parameters.get("since", "")
    return int(text) if text.isdecimal() and len(text) < 16 else None


def _answer_fields(question: Question, outlet: Outlet, as_json: bool) -> None:
    """Answer with each field asked for by its key, or a part with all its fields."""
    value = outlet.value
    described = value.describe()
    parts = [] if "**" in question.key else _parts(value.schema.paths)
    for path in (*value.schema.paths, *parts):
        key = f"{outlet.key}/{path}"
        if not question.covers(key):
            continue
        inside = [p for p in described if p == path or p.startswith(f"{path}/")]
        if as_json:
            plain = {
                "tick": outlet.n,
                "time": outlet.run.tick.t,
                "values": {p: described[p] for p in inside},
            }
            question.answer(key, json.dumps(plain).encode())
            continue
        stamp = outlet.stamp(outlet.n, outlet.run.tick.t)
        if path in described:
            told = described[path]["value"]
        else:
            told = {p[len(path) + 1 :]: described[p]["value"] for p in inside}
        question.answer(key, pack(told), "", stamp)


def _parts(paths: Sequence[str]) -> list[str]:
    """Return the parts that fields are in: `wheel` of `wheel/left`, outer first."""
    chunks = [path.split("/") for path in paths]
    inner = ("/".join(some[:n]) for some in chunks for n in range(1, len(some)))
    return list(dict.fromkeys(inner))


def tell_why(
    agents: Mapping[str, Agent],
    inlets: Sequence[Inlet],
    leases: Leases,
    key: Callable[..., str],
    question: Question,
) -> None:
    """Answer which values each agent has received and dropped. In Zenoh's thread."""
    for agent in asked(question, agents):
        if not question.covers(key(agent.key, "@why")):
            continue
        ins = {
            i.port: {
                "source": i.source or "",
                "heard": i.run.source_time(i.port),
                **i.reasons.plain(),
            }
            for i in inlets
            if i.agent is agent and i.port[0] != "@"
        }
        if holder := leases.holder(agent.key):
            ins["command"]["source"] = holder
        if isinstance(agent, Robot):
            for port in ins:
                if port.partition("/")[0] == "command":
                    ins[port]["max_age"] = agent.max_age
        told = {
            "tick": runtime(agent).tick.n,
            "time": runtime(agent).tick.t,
            "ins": ins,
            "made_of": made_of(type(agent)),
        }
        question.answer(key(agent.key, "@why"), json.dumps(told).encode())


#: By class; the source of a class is read from its file once.
_made: dict[type, tuple[str, str]] = {}


def made_of(cls: type) -> tuple[str, str]:
    """Return the name of the class that defines an agent, and its source's digest.

    For a robot that is `Cart` and `Kinematic`, the class is Cart.
    """
    if cls not in _made:
        of = definition_of(cls)
        try:
            source = inspect.getsource(of)
        except (OSError, TypeError):  # the source is in no file, or the file is gone
            source = ""
        digest = blake2b(source.encode(), digest_size=8).hexdigest()
        _made[cls] = of.__name__, digest
    return _made[cls]


def tell_scene(
    agents: Mapping[str, Agent], key: Callable[..., str], question: Question
) -> None:
    """Answer with a world's place, or a robot's outline and rays. In its own thread."""
    for agent in asked(question, agents):
        full = key(agent.key, "@scene")
        if question.covers(full):
            said = {"made_of": made_of(type(agent))[0], **scene_of(agent)}
            question.answer(full, json.dumps(said).encode())


def tell_settings(
    agents: Mapping[str, Agent], key: Callable[..., str], question: Question
) -> None:
    """Answer with the settings of agents. Runs in Zenoh's thread."""
    for agent in asked(question, agents):
        full = key(agent.key, "@settings")
        if question.covers(full):
            rows = [_setting(*row) for row in agent.all_settings()]
            question.answer(full, json.dumps(rows).encode())


def _setting(name: str, field: Field, found: dict[str, Any]) -> dict[str, Any]:
    row = {"name": name, "dtype": field.dtype, "doc": field.doc, **found}
    if field.range is not None:
        row["range"] = list(field.range)
    if field.choices:
        row["choices"] = list(field.choices)
    return row


def tell_where(inbox: Inbox, question: Question) -> None:
    """Answer with the line of code at which this host is."""
    inbox.done.settle()  # the clock names the tick that does not end, and none before
    question.answer(question.key, where(inbox.thread).encode())


def tell_driver(leases: Leases, key: Callable[..., str], question: Question) -> None:
    """Answer who drives each robot that a person drives, or a run elsewhere."""
    for agent, holder in leases.holders().items():
        full = key(agent, "@driver")
        if question.covers(full):
            question.answer(full, holder.encode())


def tell_stopped(
    agents: Mapping[str, Agent],
    guard: Guard,
    inbox: Inbox,
    key: Callable[..., str],
    question: Question,
) -> None:
    """Answer, for each robot, whether STOP has come, and whether the robot stands.

    With `?lost`, only robots whose devices are out of reach answer. A simulated robot
    stands still while there is no tick. Runs in Zenoh's thread.
    """
    idle = inbox.idle > IDLE
    for agent in list(agents.values()):
        full = key(agent.key, "@stopped")
        if isinstance(agent, Robot) and question.covers(full):
            if "lost" in question.parameters and agent.lockstep:
                continue  # a simulated robot; of a crowd there are a thousand
            waits = agent.lockstep and idle
            standing = Standing("simulated") if waits else agent.standing
            if "lost" in question.parameters and standing.kind != "lost":
                continue
            said = {
                "stopped": guard.stopped,
                "tick": runtime(agent).tick.n,
                "time": runtime(agent).tick.t,
                **standing.wire(),
            }
            question.answer(full, pack(said))
