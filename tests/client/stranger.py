"""A program of somebody else, written with plain zenoh: it answers for everything.

python stranger.py ENDPOINT WAY [KEY]; prints a line when it is there, ends with its
standard input.
"""

import json
import sys
from typing import Any

import msgpack
import zenoh

#: what it answers: nothing, ever; the same, and says that it knows everything; bytes
#: of no kind; a refusal; a lot; without an end; what looks like an answer and is none.
#: What is an answer (an empty roster is one) is believed: that is for access control.
GARBAGE: dict[str, list[bytes]] = {
    "garbage": [b"", b"\xc1", b"\xff\xfe", b"null", b"[[]]", b"{}", b'{"tick": 1}'],
    "maps": [
        b'{"tick": 1, "time": 0.5, "values": {"x": 3}}',
        b'{"tick": 1, "time": 1e999, "values": {}}',
        b'{"tick": 1, "time": 1, "values": {"\\u001b[2J": {"value": 1, "unit": "m"}}}',
        b'[{"agent": "robot/free", "kind": "spy"}]',
        b'[{"agent": "\\u001b", "kind": "robot", "host": "", "rate": 1, "seen": 1, '
        b'"tick": 1}]',
        b"[" * 100_000,
        msgpack.packb({"command": b"\x80", "state": 7}),
        msgpack.packb({"wrong": 1}),
        msgpack.packb([1, 2]),
    ],
    "huge": [bytes(17 * 1024 * 1024)],
}


def main() -> None:
    endpoint, way = sys.argv[1:3]
    keys = sys.argv[3:] or ["**", "*/*/@schema", "*/*/@call/*", "clock/@call/*"]
    kept: list[Any] = []

    def here(query: Any) -> None:
        if str(query.key_expr) == f"rems/stranger/{way}":
            query.reply(query.key_expr, b"1")
        query.drop()

    def answer(query: Any) -> None:
        if str(query.key_expr).startswith("rems/stranger/"):  # `here` answers that
            query.drop()
            return
        if way == "refuse":
            query.reply_err(b"\xff\x1b[2J there is no such thing")
            query.drop()
            return
        for payload in GARBAGE.get(way, []):
            key = str(query.key_expr).replace("**", "x/y/z").replace("*", "x")
            query.reply(key, payload)
            query.reply_err(payload)
        if way != "drop":
            kept.append(query)

    config = {
        "mode": "client",
        "connect": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        declared = [
            session.declare_queryable(
                f"rems/{key}",
                zenoh.handlers.Callback(answer, indirect=False),
                complete=way == "complete",
            )
            for key in keys
        ]
        declared.append(session.declare_queryable(f"rems/stranger/{way}", here))
        print("here", flush=True)
        sys.stdin.read()
        del declared


if __name__ == "__main__":
    main()
