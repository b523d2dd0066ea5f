"""`rems why` between machines: what networks and firewalls do, made and told."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.router.finding.way import _of_linux, _of_netstat
from tests.reliability.rig.rig import Rig, missing


def cannot() -> str:
    if reason := missing():
        return reason
    gone = [one for one in ("ip", "iptables") if shutil.which(one) is None]
    return f"there is no {gone[0]} (package {gone[0]})" if gone else ""


needs_machines = pytest.mark.skipif(bool(cannot()), reason=cannot())
HUB, GATE, NOBODY = "10.77.0.1", "10.77.0.3", "10.77.0.99"


class Room(Rig):
    """Three machines in one network: one that serves, a laptop, and the gateway."""

    def do(self, machine: str, line: str) -> None:
        """Run a command there, to its end."""
        program = self.start("do", line.split(), machine)
        assert program.process.wait(30) == 0, f"{line}: {program.text()}"

    def doctor(self, address: str = HUB) -> tuple[list[str], list[str]]:
        """What the laptop's doctor says is well, and what is not."""
        program = self.rems("router", "status", address, machine="laptop")
        status = program.process.wait(120)
        lines = program.text().splitlines()
        bad = [line.removeprefix("BAD  ") for line in lines if line[:4] == "BAD "]
        assert status == (1 if bad else 0), program.text()
        return [line[5:] for line in lines if line[:2] == "ok"], bad

    def serve(self) -> None:
        program = self.rems("router", "serve", "--no-qr", machine="hub")
        program.wait_for("^rems: ", 60.0)  # that everybody is let in


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    with Room(tmp_path / "room") as room:
        room.connect("hub", "laptop", "gate")
        room.do("laptop", f"ip route add default via {GATE}")
        yield room


def filter_port(room: Room, words: str) -> None:
    """Have the hub's firewall do this with what comes to the router's port."""
    room.do("hub", "iptables --flush INPUT")
    room.do("hub", f"iptables --append INPUT -p tcp --dport 7447 --jump {words}")


@pytest.mark.root
@pytest.mark.timeout(400)
@needs_machines
def test_firewalls(room: Room) -> None:
    room.serve()
    filter_port(room, "DROP")
    assert room.doctor()[1] == [
        f"{HUB} is there, and lets nobody in at port 7447: its firewall drops what "
        "comes; allow Python on it"
    ]
    filter_port(room, "REJECT --reject-with icmp-host-prohibited")
    assert room.doctor()[1] == [
        f"a firewall refuses what comes to port 7447 of {HUB}: allow Python on it"
    ]
    filter_port(room, "REJECT")
    (sentence,) = room.doctor()[1]
    assert sentence.startswith(f"{HUB} is there, and nothing listens at port 7447: ")
    assert sentence.endswith("a firewall refuses what comes: allow Python on it")


@pytest.mark.root
@pytest.mark.timeout(400)
@needs_machines
def test_laptops_that_are_kept_apart_and_addresses_that_are_wrong(room: Room) -> None:
    room.serve()
    room.cut("hub", "laptop")  # each of them still has the gateway
    for address in (HUB, NOBODY):
        assert room.doctor(address)[1] == [
            f"{address} does not answer, and {GATE}, the gateway of this network "
            f"(10.77.0.0/24), does: {address} is off or has another address now (see "
            "`rems router serve`), its firewall drops what comes (allow Python on "
            "it), or this Wi-Fi keeps laptops apart (client isolation): use a hotspot "
            "or an access point of your own"
        ]
    assert room.doctor("10.20.0.1")[1] == [
        "10.20.0.1 does not answer, and is not on the network of this laptop "
        "(10.77.0.0/24): are both in the same Wi-Fi? If they are, it has another "
        "address by now: see what `rems router serve` prints"
    ]
    room.do("laptop", "ip link set eth0 down")
    (sentence,) = room.doctor()[1]
    assert sentence.startswith(f"{HUB} can't be reached from this network (")


@pytest.mark.root
@pytest.mark.timeout(400)
@needs_machines
def test_a_vpn(room: Room) -> None:
    room.serve()
    room.do("laptop", "ip tuntap add dev tun0 mode tun")
    room.do("laptop", "ip address add 10.8.0.2/24 dev tun0")
    room.do("laptop", "ip link set tun0 up")
    assert room.doctor()[1] == []  # it is on, and in nobody's way
    assert room.doctor("10.20.0.1")[1][1] == (
        "a VPN is on (tun0), which may hide the network of this room; turn it off and "
        "try again"
    )
    room.do("laptop", f"ip route add {HUB}/32 dev tun0")
    assert room.doctor()[1] == [
        "the way there leads into a VPN (tun0), and ends in it: turn it off, and try "
        "again"
    ]


@pytest.mark.root
@pytest.mark.timeout(400)
@needs_machines
def test_multicast_passes_and_is_blocked(room: Room) -> None:
    for machine in ("hub", "laptop"):
        room.do(machine, "ip link set eth0 multicast on")
        room.do(machine, "ip route add 224.0.0.0/4 dev eth0")
    room.serve()
    good, bad = room.doctor()
    assert (good[-1], bad) == ("multicast passes: `rems router use` alone finds it", [])
    room.do("laptop", "iptables --append OUTPUT --dst 224.0.0.0/4 --jump DROP")
    good, bad = room.doctor()
    assert (good[-1], bad) == (
        "multicast does not pass, so `rems router use` alone does not find it; "
        "nothing else needs it",
        [],
    )


@pytest.mark.root
@pytest.mark.timeout(400)
@needs_machines
def test_a_code_is_typed_on_another_laptop(room: Room) -> None:
    program = room.rems("router", "serve", "--no-qr", machine="hub")
    code = program.wait_for("its code: rems router use (.*)$", 60.0)[1]
    joined = room.rems("router", "use", code, machine="laptop")
    assert joined.process.wait(60) == 0, joined.text()
    assert joined.text().startswith(f"Joined tcp/{HUB}:7447. ")


def test_gateways_as_systems_tell_them() -> None:
    """Linux by its file; macOS and Windows by the words of their `netstat -rn`."""
    assert _of_linux(
        "Iface\tDestination\tGateway\tFlags\tRefCnt\tUse\tMetric\tMask\t\tMTU\n"
        "eth0\t0002000A\t00000000\t0001\t0\t0\t0\t00FFFFFF\t0\n"
        "eth0\t00000000\t0101A8C0\t0003\t0\t0\t100\t00000000\t0\n"
    ) == ("192.168.1.1")
    assert _of_netstat(
        "Routing tables\n\nInternet:\n"
        "Destination        Gateway            Flags           Netif Expire\n"
        "default            10.0.1.1           UGScg             en0\n"
        "127                127.0.0.1          UCS               lo0\n"
    ) == ("10.0.1.1")
    assert _of_netstat(
        "Network Destination        Netmask          Gateway       Interface  Metric\n"
        "          0.0.0.0          0.0.0.0      192.168.1.1     192.168.1.20     35\n"
        "        127.0.0.0        255.0.0.0         On-link         127.0.0.1    331\n"
    ) == ("192.168.1.1")
    assert _of_linux("Iface\tDestination\tGateway\n") == _of_netstat("") == ""
