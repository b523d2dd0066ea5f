"""A probe of the rig itself: UDP packets one way and back, and bytes of a TCP stream.

python -m tests.reliability.rig.probe serve 10.77.0.1
python -m tests.reliability.rig.probe udp 10.77.0.1 COUNT INTERVAL   prints JSON:
    {"one_way": [s...], "round_trip": [s...], "sent": COUNT}
python -m tests.reliability.rig.probe tcp 10.77.0.1 SECONDS          prints bit/s
All machines of a rig share one monotonic clock, so one way can be measured.
"""

import json
import os
import socket
import struct
import sys
import threading
import time

PORT = 7000
PACKET = struct.Struct("!idd")  # number, sent, arrived at the server
CHUNK = bytes(64 * 1024)


def serve(address: str) -> None:
    """Echo UDP packets, with the time of arrival; count what TCP brings."""
    stream = socket.create_server((address, PORT))

    def count() -> None:
        while True:
            caller, _ = stream.accept()
            with caller:
                total, begun = 0, time.monotonic()
                while (more := len(caller.recv(1 << 20))) > 0:
                    total += more
                    if time.monotonic() - begun > 60:
                        break
                spent = time.monotonic() - begun
                print(f"rate {8 * total / spent:.0f}", flush=True)

    threading.Thread(target=count, daemon=True).start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as echo:
        echo.bind((address, PORT))
        print("ready", flush=True)
        while True:
            packet, sender = echo.recvfrom(2048)
            number, sent, _ = PACKET.unpack(packet)
            echo.sendto(PACKET.pack(number, sent, time.monotonic()), sender)


def udp(address: str, count: int, interval: float) -> None:
    """Send packets at a steady pace; print what came back."""
    one_way: list[float] = []
    round_trip: list[float] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((address, PORT))

        def receive() -> None:
            while True:
                try:
                    _, sent, arrived = PACKET.unpack(probe.recv(2048))
                except OSError:
                    return
                one_way.append(arrived - sent)
                round_trip.append(time.monotonic() - sent)

        probe.settimeout(2.0)
        receiver = threading.Thread(target=receive)
        receiver.start()
        begun = time.monotonic()
        for number in range(count):
            time.sleep(max(0.0, begun + number * interval - time.monotonic()))
            probe.send(PACKET.pack(number, time.monotonic(), 0.0))
        receiver.join()
    print(
        json.dumps({"one_way": one_way, "round_trip": round_trip, "sent": count}),
        flush=True,
    )


def tcp(address: str, seconds: float) -> None:
    """Send as much as goes; the server prints the rate."""
    with socket.create_connection((address, PORT)) as stream:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            stream.sendall(CHUNK)
    print("sent", flush=True)


if __name__ == "__main__":
    # What is measured is the network, and not how busy the computer is.
    os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    what, where, *numbers = sys.argv[1:]
    if what == "serve":
        serve(where)
    elif what == "udp":
        udp(where, int(numbers[0]), float(numbers[1]))
    else:
        tcp(where, float(numbers[0]))
