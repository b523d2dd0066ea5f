"""Robots that know STOP and nothing else, and a clock that releases it.

python standin.py ENDPOINT NAME=WAY ...; prints a line when all are there, ends with its
standard input. Written with plain zenoh, as the firmware of a robot would do it.

Ways: `stands` at once, `brakes` for 0.3 s, `moves` for ever, `mute` answers nothing;
`clock=...` is the one that releases.
"""

import json
import sys
import time
from typing import Any

import msgpack
import zenoh


class Robot:
    """One robot: when it heard STOP, and what it says about it."""

    def __init__(self, session: Any, name: str, way: str):
        self.way, self.heard = way, 0.0
        self.key = f"rems/robot/{name}/@stopped"
        self.kept: list[Any] = []
        self.declared = [
            session.declare_subscriber("rems/stop", direct(self.stop)),
            session.declare_queryable(self.key, direct(self.answer)),
            session.liveliness().declare_token(f"rems/robot/{name}/@alive"),
        ]

    def stop(self, sample: Any) -> None:
        if msgpack.unpackb(sample.payload.to_bytes()) is True and not self.heard:
            self.heard = time.monotonic()

    def answer(self, query: Any) -> None:
        if self.way == "mute":
            self.kept.append(query)
            return
        long_enough = time.monotonic() - self.heard > 0.3 * (self.way == "brakes")
        stands = bool(self.heard) and long_enough and self.way != "moves"
        said = {
            "stopped": bool(self.heard),
            "tick": 412,
            "time": 8.24,
            "standing": "confirmed" if stands else "sent",
        }
        query.reply(self.key, msgpack.packb(said))
        query.drop()


def direct(function: Any) -> Any:
    return zenoh.handlers.Callback(function, indirect=False)


def releasing(session: Any, key: str, said: object) -> Any:
    def answer(query: Any) -> None:
        query.reply(key, msgpack.packb(said))
        query.drop()

    return session.declare_queryable(key, direct(answer))


def main() -> None:
    config = {
        "mode": "client",
        "connect": {"endpoints": [sys.argv[1]]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(config))) as session:
        kept: list[Any] = []
        for name, way in (word.split("=") for word in sys.argv[2:]):
            if name == "clock":
                said: dict[str, Any] = {"result": way.split(",")}
                kept.append(releasing(session, "rems/clock/@call/release", said))
                kept.append(session.liveliness().declare_token("rems/clock/@alive"))
            else:
                kept.append(Robot(session, name, way))
        print("here", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
