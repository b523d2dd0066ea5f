"""The bridge: machines out of network namespaces, and the links between them.

`python -m tests.reliability.rig.bridge hub=10.77.0.1 bot=10.77.0.2` makes a namespace
for each, with a TUN device that has this address, and carries packets from one device
to the others. All that it makes lives in this process: when it ends, whatever the way,
devices and addresses are gone with it. Nothing outside of these namespaces is touched.

It first prints a line of JSON, {machine: [path of its network namespace, path of its
host name's]}, and then answers each line of JSON on its standard input by one:
{"from": "bot", "to": "hub", "delay": 0.02} ("*" for all), {"machine": "bot", "address":
"10.77.0.9"}, or {} for the counts.
"""

import ctypes
import fcntl
import heapq
import json
import os
import select
import socket
import struct
import sys
import time
from pathlib import Path
from typing import Any

from tests.reliability.rig.link import Link

NEW_NET, NEW_HOST_NAME = 0x40000000, 0x04000000
TIMER_SLACK = 29
TUN_SET, TUN_PLAIN = 0x400454CA, 0x1001  # a TUN device, packets without a header
SET_ADDRESS, SET_MASK, SET_FLAGS, UP = 0x8916, 0x891C, 0x8914, 0x1001
DEVICE = b"eth0"
#: packets taken from one device before the others have their turn
BATCH = 64


def _own(flags: int) -> None:
    """Leave the namespaces of this process for new ones."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(flags):
        raise OSError(ctypes.get_errno(), "cannot make a namespace; that needs root")
    libc.prctl(TIMER_SLACK, 1)


class Machine:
    """A namespace with a device, as the bridge sees it."""

    def __init__(self, name: str, address: str):
        self.name = name
        _own(NEW_NET | NEW_HOST_NAME)
        socket.sethostname(name)
        self.tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        request = struct.pack("16sH22x", DEVICE, TUN_PLAIN)
        fcntl.ioctl(self.tun, TUN_SET, request)
        #: a socket stays in the namespace in which it was made
        self._control = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.move(address)
        for device in (b"lo", DEVICE):
            request = struct.pack("16sH22x", device, UP)
            fcntl.ioctl(self._control, SET_FLAGS, request)
        self.files = [
            os.open(f"/proc/self/ns/{n}", os.O_RDONLY) for n in ("net", "uts")
        ]

    def move(self, address: str) -> None:
        """Give the device an address, in place of the one that it has."""
        self.address = socket.inet_aton(address)
        mask = socket.inet_aton("255.255.255.0")
        for what, value in ((SET_ADDRESS, self.address), (SET_MASK, mask)):
            request = struct.pack("16sHH4s16x", DEVICE, socket.AF_INET, 0, value)
            fcntl.ioctl(self._control, what, request)

    def paths(self) -> list[str]:
        """Where others find its namespaces, as long as this process lives."""
        return [f"/proc/{os.getpid()}/fd/{number}" for number in self.files]


class Bridge:
    """Carries packets between machines."""

    def __init__(self, addresses: dict[str, str]):
        self.machines = [Machine(name, at) for name, at in addresses.items()]
        self.by_tun = {m.tun: m for m in self.machines}
        self._find()
        self.links = {
            (a.name, b.name): Link()
            for a in self.machines
            for b in self.machines
            if a is not b
        }
        self._way: list[tuple[float, int, Link, int, bytes]] = []
        self._count = 0

    def _find(self) -> None:
        self.by_address = {m.address: m for m in self.machines}

    def run(self) -> None:
        """Carry until the standard input closes."""
        waiting = [0, *self.by_tun]
        while True:
            timeout = None
            if self._way:
                timeout = max(0.0, self._way[0][0] - time.monotonic())
            for ready in select.select(waiting, (), (), timeout)[0]:
                if ready:
                    self._take(self.by_tun[ready])
                elif not self._obey():
                    return
            now = time.monotonic()
            while self._way and self._way[0][0] <= now:
                _, _, link, tun, packet = heapq.heappop(self._way)
                self._deliver(link, tun, packet)

    def _take(self, source: Machine) -> None:
        for _ in range(BATCH):
            try:
                packet = os.read(source.tun, 65536)
            except BlockingIOError:
                return
            if packet[0] >> 4 != 4:  # these machines speak IPv4 only
                continue
            target = self.by_address.get(packet[16:20])
            if target is not None:
                self._send(source, target, packet)
            elif packet[16] >= 224 or packet[19] == 255:  # to everybody
                for other in self.machines:
                    link = self.links.get((source.name, other.name))
                    if link is not None and link.multicast:
                        self._send(source, other, packet)

    def _send(self, source: Machine, target: Machine, packet: bytes) -> None:
        link = self.links.get((source.name, target.name))
        if link is None:  # to itself
            return
        now = time.monotonic()
        due = link.due(now, len(packet))
        if due is None:
            return
        if due <= now:
            self._deliver(link, target.tun, packet)
        else:
            self._count += 1
            heapq.heappush(self._way, (due, self._count, link, target.tun, packet))

    def _deliver(self, link: Link, tun: int, packet: bytes) -> None:
        if link.cut:
            link.lost += 1
            return
        link.passed += 1
        try:
            os.write(tun, packet)
        except OSError:  # its queue is full, as a device's may be
            link.lost += 1

    def _obey(self) -> bool:
        """Read one line from the standard input; whether there was any."""
        line = sys.stdin.readline()
        if not line:
            return False
        try:
            answer = self._change(**json.loads(line))
        except (ValueError, TypeError) as error:
            answer = {"error": str(error)}
        print(json.dumps(answer), flush=True)
        return True

    def _change(self, **told: Any) -> dict[str, Any]:
        if "address" in told:
            machine = next(m for m in self.machines if m.name == told["machine"])
            machine.move(told["address"])
            self._find()
            return {}
        source, target = told.pop("from", "*"), told.pop("to", "*")
        for name in (source, target):
            if name != "*" and name not in {m.name for m in self.machines}:
                raise ValueError(f"there is no machine {name!r}")
        counts = {}
        for (a, b), link in self.links.items():
            if source in (a, "*") and target in (b, "*"):
                link.change(**told)
                counts[f"{a}>{b}"] = [link.passed, link.lost]
        return counts


def main() -> int:
    given = dict(word.split("=", 1) for word in sys.argv[1:])
    if not Path("/dev/net/tun").exists():
        print(json.dumps({"error": "there is no /dev/net/tun"}), flush=True)
        return 1
    try:
        bridge = Bridge(given)
    except OSError as error:
        print(json.dumps({"error": str(error)}), flush=True)
        return 1
    paths = {m.name: m.paths() for m in bridge.machines}
    print(json.dumps(paths), flush=True)
    # A network does not get slower because computers are busy.
    os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    bridge.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
