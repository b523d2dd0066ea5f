"""What a host answers when a key is asked for: ports, fields, schemas."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rems_net.agents.mail import Outlet
from rems_net.router.message import pack
from rems_net.router.session import Question, pack_stamp

if TYPE_CHECKING:
    from rems_net.agents.host import Host


def answer(question: Question, host: Host) -> None:
    """Answer with every port the question covers, or with fields of ports.

    `?format=json` gives values with units, for people and other languages; `?since=7`
    what was written since tick 7, as far as it is kept, for who has not heard it.
    """
    as_json = question.parameters.get("format") == "json"
    with question:
        asked = host.asked(question)
        if question.key.endswith("/@schema"):
            for agent in asked:
                key = host.session.key(agent.key, "@schema")
                if question.covers(key):
                    schemas = {p: s.to_wire() for p, s in agent.published().items()}
                    question.answer(key, pack(schemas))
            return
        keys = {agent.key for agent in asked}
        for outlet in host.outlets:
            if outlet.agent.key in keys:
                if question.covers(outlet.key):
                    _answer_port(question, outlet, as_json)
                elif question.covers(f"{outlet.key}/**"):
                    _answer_fields(question, outlet, as_json)


def _answer_port(question: Question, outlet: Outlet, as_json: bool) -> None:
    value, time = outlet.value, outlet.agent.tick.t
    if as_json:
        plain = {"tick": outlet.n, "time": time, "values": value.describe()}
        question.answer(outlet.key, json.dumps(plain).encode())
        return
    schema = f"{value.schema.name}@{outlet.digest}"
    since = question.parameters.get("since", "")
    first = int(since) if since.isdecimal() and len(since) < 16 else outlet.n
    for n, payload, stamp in outlet.recent:
        if first <= n < outlet.n:
            question.answer(outlet.key, payload, schema, stamp)
    question.answer(outlet.key, value.encode(), schema, pack_stamp(outlet.n, time))


def _answer_fields(question: Question, outlet: Outlet, as_json: bool) -> None:
    value = outlet.value
    described = value.describe()
    for path in value.schema.paths:
        key = f"{outlet.key}/{path}"
        if not question.covers(key):
            continue
        if as_json:
            plain = {
                "tick": outlet.n,
                "time": outlet.agent.tick.t,
                "values": {path: described[path]},
            }
            question.answer(key, json.dumps(plain).encode())
        else:
            stamp = pack_stamp(outlet.n, outlet.agent.tick.t)
            question.answer(key, pack(described[path]["value"]), "", stamp)
