"""An agent in plain Zenoh: a robot of an experiment, as in time.md."""

import hashlib
import math
import os
import platform
import queue
import sys

import zenoh
from msgpack import packb, unpackb

HOST, ME, TOLD = "robot/plain", "rems/robot/plain", "rems/input/steady/@step/value"
ASKED = "rems/input/steady/value"
CONFIG = """{mode: "client", connect: {endpoints: ["%s"]}, scouting: {multicast:
    {enabled: false}}, transport: {shared_memory: {enabled: false}}}"""
FIELDS = {
    "command": [
        ["speed", "float", {"range": [-1.0, 1.0], "unit": "m/s"}],
        ["turn", "float", {"range": [-2.0, 2.0], "unit": "rad/s"}],
    ],
    "state": [
        ["x", "float", {"unit": "m"}],
        ["y", "float", {"unit": "m"}],
        ["heading", "float", {"unit": "rad"}],
    ],
}
mail, state = queue.SimpleQueue(), {"x": 0.0, "y": 0.0, "heading": 0.0}
outs, schemas, ticks, heard, said = {}, {}, {}, {}, {}
for port, fields in FIELDS.items():
    outs[port] = hashlib.sha256(packb([1, sorted(fields)])).hexdigest()[:16]
    schemas[outs[port]] = packb({"rems": 1, "name": f"cart.{port}", "fields": fields})
entry = {"key": HOST, "host": HOST, "outs": outs, "reads": ["input/steady"], "every": 1}
entry |= {"lockstep": True, "since": 1, "badge": 0}
me = {"host": HOST, "machine": platform.node(), "pid": os.getpid(), "closing": ""}
me |= {"agents": [entry], "schemas": schemas, "stopped": False, "ticket": 0}
ALL = zenoh.ConsolidationMode.NONE
BLOCK = zenoh.CongestionControl.BLOCK
SURE = {"priority": zenoh.Priority.INTERACTIVE_HIGH, "congestion_control": BLOCK}
with zenoh.open(zenoh.Config.from_json5(CONFIG % sys.argv[1])) as session:
    for key in ("rems/clock/@step/tick", "rems/clock/@step/roster", TOLD):
        session.declare_subscriber(key, mail.put)
    session.declare_queryable(f"{ME}/**", mail.put)
    token = session.liveliness().declare_token(f"{ME}/@alive")
    for reply in session.get("rems/clock/@join", payload=packb(me)):
        assert reply.ok, reply.err.payload.to_string()
        seat = unpackb(reply.ok.payload.to_bytes())
    badge, done, dt = seat["badge"], seat["first"] - 1, seat["dt"]
    run = badge >> 24
    shown = session.liveliness().declare_token(f"rems/clock/@member/{badge}")
    while True:
        letter = mail.get()
        if isinstance(letter, zenoh.Query):
            with letter:  # a host missed one of the last ten values
                for (key, _), (payload, stamp) in said.items():
                    if letter.key_expr.intersects(zenoh.KeyExpr(key)):
                        letter.reply(key, payload, attachment=stamp)
            continue
        key, content = str(letter.key_expr), unpackb(letter.payload.to_bytes())
        if key == "rems/clock/@step/roster":
            if content["run"] == run and not content["agents"]:
                break
        elif key in (TOLD, ASKED):
            n, _, writer = unpackb(letter.attachment.to_bytes())
            if writer >> 24 == run:
                heard[n] = content
        elif content[0] == run:  # a tick of this run
            n, t = content[1:3]
            if n <= done or n in ticks:
                # Said again: our done was lost, or what we wait for.
                session.put("rems/clock/@step/done", packb([badge, done]), **SURE)
                asked = f"{ASKED}?since={done + 1}"
                session.get(asked, lambda r: r.ok and mail.put(r.ok), consolidation=ALL)
            else:
                ticks[n] = t
        while done + 1 in ticks and done + 1 in heard:
            done += 1
            t, command = ticks.pop(done), heard.pop(done)
            state["x"] += dt * command["speed"] * math.cos(state["heading"])
            state["y"] += dt * command["speed"] * math.sin(state["heading"])
            state["heading"] += dt * command["turn"]
            for port, values in (("command", command), ("state", state)):
                payload, stamp = packb(values), packb([done, t, badge])
                said[f"{ME}/{port}", done % 10] = payload, stamp
                step = f"{ME}/@step/{port}"
                session.put(step, payload, attachment=stamp, **SURE)
            session.put("rems/clock/@step/done", packb([badge, done]), **SURE)
    farewell = packb({"badge": badge, "made": [], "failed": None})
    for _ in session.get("rems/clock/@leave", payload=farewell):
        pass
