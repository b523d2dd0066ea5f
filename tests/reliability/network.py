"""What the rig itself does to packets: the floor of all that is measured with it."""

import json
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.reliability.page import Section, table
from tests.reliability.rig.rig import Rig

PROBE = "tests.reliability.rig.probe"
#: name, what the link is told, seconds between two packets (above twice the jitter,
#: else order, which is kept, bends what is seen)
LINKS: list[tuple[str, dict[str, float], float]] = [
    ("nothing", {}, 0.005),
    ("delay 20 ms", {"delay": 0.02}, 0.005),
    (
        "delay 20 +/- 10 ms, loss 2 %",
        {"delay": 0.02, "jitter": 0.01, "loss": 0.02},
        0.025,
    ),
    ("loss 20 %", {"loss": 0.2}, 0.005),
    ("rate 10 Mbit/s", {"rate": 10e6}, 0.005),
]


@dataclass(frozen=True)
class Seen:
    """What a probe saw from one machine to another. Times in seconds.

    rate: bits per second of one TCP stream; 0 where it was not measured
    """

    link: str
    one_way: list[float]
    round_trip: list[float]
    sent: int
    rate: float

    @property
    def lost(self) -> float:
        """The share of packets that did not come back; two ways, so twice a link's."""
        return 1 - len(self.round_trip) / self.sent

    def cells(self) -> list[str]:
        figures = [f"{1000 * part(self.one_way, p):.2f}" for p in (0.0, 0.5, 0.99)]
        trip = f"{1000 * part(self.round_trip, 0.5):.2f}"
        mean = f"{1000 * statistics.mean(self.one_way):.2f}"
        rate = f"{self.rate / 1e6:.0f}" if self.rate else ""
        return [self.link, *figures, mean, trip, f"{100 * self.lost:.1f}", rate]


def part(values: Sequence[float], share: float) -> float:
    """The value that this share of `values` does not exceed."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def measure(
    count: int,
    folder: Path,
    links: Sequence[tuple[str, dict[str, float], float]] = tuple(LINKS),
    *,
    seconds: float = 2.0,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Seen]:
    """Send so many packets over each kind of link."""
    found = []
    with Rig(folder) as rig:
        rig.connect("one", "other")
        address = rig.addresses["one"]
        server = rig.module(PROBE, "serve", address, machine="one")
        server.wait_for("^ready")
        streams = 0
        for name, link, interval in links:
            rig.link("one", **{"delay": 0.0, "jitter": 0.0, "loss": 0.0, "rate": 0.0})
            rig.link("one", **link)
            words = "udp", address, count, interval
            probe = rig.module(PROBE, *words, machine="other")
            told = json.loads(probe.wait_for("^{.*", 30 + 2 * count * interval).group())
            rate = 0.0
            if "loss" not in link and seconds:
                rig.module(PROBE, "tcp", address, seconds, machine="other")
                streams += 1
                server.wait_for(rf"(^rate .*\n(.*\n)*?){{{streams}}}", seconds + 30)
                rate = float(server.text().split("rate ")[-1])
            found.append(Seen(name, **told, rate=rate))
            tell(" | ".join(found[-1].cells()))
    return found


HEAD = ["link", "least [ms]", "p50 [ms]", "p99 [ms]", "mean [ms]", "and back [ms]"]
HEAD += ["lost [%]", "TCP [Mbit/s]"]
TEXT = """Machines are Linux network namespaces on one computer. A process in user
space carries every packet between their TUN devices, with a delay, jitter, loss and
rate for each direction. The table has the times of UDP packets of 20 bytes, one way
and there and back (median), and the packets that did not come back (two ways: twice
the loss of a link)."""


def section(found: Sequence[Seen]) -> Section:
    """What docs/measured/reliability.md says."""
    lines = table(HEAD, [one.cells() for one in found])
    return Section("rig", "The rig itself", TEXT, lines)
