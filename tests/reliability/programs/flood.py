"""A flood: a plain zenoh program that puts so many messages a second at a key.

python -m tests.reliability.programs.flood ENDPOINT KEY [--rate R] [--seconds S]
    [--payload HEX]

Bounded, whatever it is told: at most 20,000 a second for 10 s, to the loopback or to
the rig's own machines. `{}` in the key becomes a number that no key had before. It
says `flooding` at its first message, and at the end how many it put, in how many s.
"""

import argparse
import json
import time

import zenoh

RATE, SECONDS, SIZE = 20_000, 10.0, 65_536
ALLOWED = ("tcp/127.0.0.1:", "tcp/10.77.0.")
#: puts between two looks at the clock
BATCH = 50


def client(endpoint: str) -> zenoh.Config:
    """How a plain program joins a router."""
    told = {
        "mode": "client",
        "connect": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"shared_memory": {"enabled": False}},
    }
    return zenoh.Config.from_json5(json.dumps(told))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("endpoint")
    parser.add_argument("key")
    parser.add_argument("--rate", type=int, default=10_000)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--payload", type=bytes.fromhex, default=b"\xc1\x00\x00\x00")
    given = parser.parse_args()
    if not given.endpoint.startswith(ALLOWED):
        parser.error(f"{given.endpoint} is none of {', '.join(ALLOWED)}...")
    if given.rate > RATE or given.seconds > SECONDS or len(given.payload) > SIZE:
        parser.error(f"at most {RATE} a second, {SECONDS} s, {SIZE} bytes")
    count = round(given.rate * given.seconds)
    with zenoh.open(client(given.endpoint)) as session:
        print("flooding", flush=True)
        begun = time.monotonic()
        for first in range(0, count, BATCH):
            left = begun + first / given.rate - time.monotonic()
            if left > 0:
                time.sleep(left)
            elif left < -given.seconds:  # the way is too narrow: bounded in time, too
                count = first
                break
            for number in range(first, min(first + BATCH, count)):
                key = given.key.format(number) if "{" in given.key else given.key
                session.put(
                    key,
                    given.payload,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                    priority=zenoh.Priority.INTERACTIVE_HIGH,
                )
        spent = time.monotonic() - begun
    print(f"put {count} in {spent:.2f} s", flush=True)


if __name__ == "__main__":
    main()
