"""A fuzzer for every machine key of `docs/time.md`: noise, and messages damaged.

    python -m tests.agents.protocol.fuzz 10_000_000 [seed]

Whatever comes, a reader returns something that fits or raises WireError. Anything else
ends the run and prints the message.
"""

import random
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol.alike import pack_version, read_version
from rems_net.agents.protocol.badge import badge_of
from rems_net.agents.protocol.crowds import pack_crowd, read_crowd
from rems_net.agents.protocol.messages import (
    Admission,
    Farewell,
    Request,
    pack_age,
    pack_beat,
    pack_done,
    read_admission,
    read_age,
    read_badge,
    read_beat,
    read_claim,
    read_done,
    read_farewell,
    read_request,
    read_stop,
)
from rems_net.agents.protocol.placement import (
    Caller,
    File,
    Offer,
    read_caller,
    read_offer,
)
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import outcome, perform, request
from rems_net.dashboard.protocol import read_report
from rems_net.errors import AgentError, WireError
from rems_net.router.gate.stops import Stop, read_said
from rems_net.router.message import pack, pack_stamp, read_stamp
from tests.defdict.fuzz import mutate

PAGE = Path(__file__).parents[3] / "docs" / "time.md"
#: seconds of a core that one message may take
LIMIT = 0.5

Reader = Callable[[bytes], Any]

RUN = 0x1234567890
DIGEST = "0123456789abcdef"
BEAT = pack_beat(RUN, Tick(7, 0.7, 0.1, 1.0, 3), 2)
ENTRY = Entry("robot/sim", "robot/sim", {"state": DIGEST}, ["input/*"], 2, True, 3)
ROSTER = Roster(3, 7, {"robot/sim": ENTRY}, {DIGEST: b"s"}, RUN, {"robot/b": "died"})
REQUEST = Request(
    *("robot/sim", "laptop", 7, "robot/sim/state", [ENTRY], {DIGEST: b"s"}),
    numerics="Linux x86_64, pinned",
)
PLAN = {
    "name": "sim",
    "definition": "lab.py:Cart",
    "driver": "rems_net.drivers.kinematic.kinematic:Kinematic",
    "command": "input/keys",
    "parameters": {"track": 0.1},
    "every": 2,
    "since": 1.0,
    "restart": 1,
    "machine": "b",
}
OFFER = Offer(
    "lab",
    "anna",
    "laptop",
    {"robot": [PLAN]},
    {"robot/sim": {}},
    0.1,
    0,
    ["fast"],
    {"data/keys.csv": File(88, "0" * 64)},
    {"lab.py": "f" * 64},
    False,
)
CROWDS = [
    pack_crowd([pack(f"bot{i}") + pack({"x": 0.5 * i}) for i in range(count)])
    for count in (1, 3, 20)
]
CALL = request((1, "a"), {"b": [2.0]})


def called(payload: bytes) -> object:
    """A call of a verb: whatever it is called with, its answer is one."""
    answer = perform({"add": lambda *_, **__: 1}, "add", payload)
    try:
        return outcome("robot/sim", answer)
    except AgentError:
        return None


#: key of the page -> who reads what is put, asked or answered there, and good messages
READERS: dict[str, tuple[Reader, list[bytes]]] = {
    "rems/clock/@step/tick": (
        read_beat,
        [pack_beat(RUN, Tick(7, 0.7, 0.1, 1.0, 3), 2)],
    ),
    "rems/clock/@step/roster": (Roster.from_wire, [ROSTER.to_wire()]),
    "rems/clock/@step/done": (read_done, [pack_done(badge_of(RUN, 1), 7)]),
    "rems/stop": (read_stop, [pack(True)]),
    "rems/<kind>/<name>/@step/<port>": (
        read_stamp,
        [pack_stamp(7, 0.7, badge_of(RUN, 1)), pack_stamp(7, 0.7, 5, 6)],
    ),
    "rems/clock/@join": (read_request, [REQUEST.to_wire()]),
    "rems/clock/@join, answered": (
        read_admission,
        [pack(Admission(badge_of(RUN, 1), 7, 0.1, 2, 30.0)._asdict())],
    ),
    "rems/clock/@leave": (
        read_farewell,
        [
            Farewell(5, ["runs/a.csv"], None).to_wire(),
            Farewell(5, [], ("robot/sim", "ValueError: x")).to_wire(),
        ],
    ),
    "rems/clock/@version": (read_version, [pack_version()]),
    "rems/machine/<name>/@start": (
        read_caller,
        [Caller("laptop", "").to_wire(), Caller("laptop", "no lab.py").to_wire()],
    ),
    "rems/machine/<name>/@start, answered": (read_offer, [OFFER.to_wire()]),
    "rems/clock/@member": (read_badge, [pack(badge_of(RUN, 1))]),
    "rems/robot/<name>/@lease": (
        read_claim,
        [pack((badge_of(RUN, 1), "robot/a of b")), pack((5, ""))],
    ),
    "rems/robot/<name>/@lease/take": (read_claim, [pack((1, "the teacher on desk"))]),
    "rems/robot/<name>/@lease/drive": (
        read_claim,
        [pack((badge_of(RUN, 1), "anna on desk")), pack((5, ""))],
    ),
    "rems/stop/@why": (read_said, [Stop("anna on a", "10:31:07", 0.5).to_wire()]),
    "rems/clock/@event": (
        read_report,
        [pack(("info", 7, "robot/sim", "held", "tick 7 is held"))],
    ),
    "rems/clock/@age": (read_age, [pack_age(RUN, 0.25, 2)]),
    "rems/clock/@call/<verb>": (called, [CALL]),
    "rems/<kind>/@crowd/<port>": (read_crowd, CROWDS),
    "rems/<kind>/@step/<port>": (read_crowd, CROWDS),
}
#: keys of the page at which nothing is decoded that was not listed above: tokens and
#: text, what is only asked for, and values, whose decoder `tests.defdict.fuzz` tries
OTHERS = {
    "rems/clock/stops",
    "rems/stop/@holds",
    "rems/stop/@release",
    "rems/<kind>/<name>/<port>",
    "rems/robot/<name>/command",
    "rems/clock/@run/<run>",
    "rems/clock/@member/<badge>",
    "rems/<kind>/<name>/@alive",
    "rems/robot/<name>/@stopped",
    "rems/<kind>/<name>/@where",
    "rems/<kind>/<name>/@driver",
    "rems/<kind>/<name>/@event/called",
    "rems/<kind>/<name>/@scene",
    "rems/<kind>/<name>/@settings",
    "rems/<kind>/<name>/@why",
    "rems/clock/@why",
    "rems/machine/<name>/@file/<digest>",
}


def keys_of_the_page() -> set[str]:
    """The keys in the tables of `docs/time.md`."""
    rows = re.findall(r"^\| `(rems/[^`]*)`", PAGE.read_text("utf-8"), re.MULTILINE)
    return set(rows)


def attack(rng: random.Random, count: int) -> dict[str, int]:
    """Read so many messages; how many each reader took."""
    taken = dict.fromkeys(READERS, 0)
    readers = list(READERS.items())
    seeds = [message for _, good in READERS.values() for message in good]
    for i in range(count):
        key, (reader, good) = readers[i % len(readers)]
        message = mutate(rng, good if i % 3 else seeds)
        begun = time.process_time()
        try:
            reader(message)
            taken[key] += 1
        except WireError:
            pass
        except BaseException:
            print(f"{key}: {message!r}", file=sys.stderr)
            raise
        if time.process_time() - begun > LIMIT:
            raise TimeoutError(f"{key}: {message!r}")
    return taken


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    begun = time.perf_counter()
    taken = attack(random.Random(seed), count)
    print(f"{count} messages in {time.perf_counter() - begun:.0f} s; taken: {taken}")


if __name__ == "__main__":
    main()
