"""The cable as the network: real sessions to a real router, through bad lines, too."""

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from rems_net.cable import frame
from rems_net.cable.frame import Frame, Kind
from rems_net.errors import FabricError, WireError
from rems_net.router.finding.address import host_and_port
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router
from tests.commands import finished
from tests.firmware.console.cable import Cabled
from tests.firmware.console.robot import TIMEOUT, Robot, build

pytest.importorskip("serial", reason="pyserial is not installed.")


@pytest.fixture(scope="session")
def cable_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(
        tmp_path_factory.mktemp("cable"),
        "test_cable",
        ("settings/crc32", "console/improv"),
        *("cable/cable.c", "cable/console_side.c", "cable/cable_socket.c"),
    )


@contextmanager
def cabled(
    program: Path, router: tuple[str, int], loss: float = 0.0
) -> Iterator[Cabled]:
    made = Cabled(program, router, loss)
    try:
        yield made
    finally:
        made.close()


def until(true: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def opened(endpoint: str) -> Session:
    """A session at an address that answers as soon as it can."""
    session = Session(Link(endpoint))
    end = time.monotonic() + TIMEOUT
    while True:
        try:
            session.open()
            return session
        except FabricError:
            assert time.monotonic() < end


def heard(box: Mailbox, session: Session, key: str, payload: bytes) -> None:
    """Put until it is heard: who watches is told to the others a little later."""
    end = time.monotonic() + TIMEOUT
    while True:
        assert time.monotonic() < end
        session.put(key, payload)
        mail = box.get(0.1)
        if isinstance(mail, Mail) and mail.payload == payload:
            return


def test_a_session_goes_through(cable_program: Path) -> None:
    with Router() as router:
        where = host_and_port(router.endpoint)
        with cabled(cable_program, where) as cable, Session(Link(router.endpoint)) as a:
            b = opened(cable.locator)
            there, here = Mailbox(), Mailbox()
            a.watch("rems/robot/w7/state", there)
            b.watch("rems/robot/w7/command", here)
            heard(there, b, "rems/robot/w7/state", b"\xc0\xdb" * 50)
            heard(here, a, "rems/robot/w7/command", b"\xdb\xdc\xc0" * 50)
            heard(there, b, "rems/robot/w7/state", bytes(range(256)) * 15)
            # a line of its console goes beside it
            cable.say("status")
            until(lambda: "status" in cable.told)
            b.close()
            until(lambda: cable.told[-1].startswith("a session is over: "))
            # and the next session is as good
            with opened(cable.locator) as b:
                heard(there, b, "rems/robot/w7/state", b"again")


def test_the_router_is_started_again(cable_program: Path) -> None:
    with Router() as router:
        where = host_and_port(router.endpoint)
        with cabled(cable_program, where) as cable:
            first = opened(cable.locator)
            router.kill()
            until(lambda: not first.connected)
            first.close()
            with pytest.raises(FabricError):
                Session(Link(cable.locator)).open()
            until(lambda: any(t.startswith("no router at") for t in cable.told))
            router.start()
            with opened(cable.locator) as second, Session(Link(router.endpoint)) as a:
                box = Mailbox()
                a.watch("rems/robot/w7/state", box)
                heard(box, second, "rems/robot/w7/state", b"back")


def echo(listener: socket.socket) -> None:
    there, _ = listener.accept()
    with there:
        while portion := there.recv(4096):
            there.sendall(portion)


@pytest.mark.parametrize("loss", [0.0, 0.0005])
def test_every_byte_arrives_once_and_in_order(cable_program: Path, loss: float) -> None:
    """Of a line that loses and damages bytes, both ways at once."""
    sent = bytes((i * i) % 251 for i in range(20_000)) + b"\xc0\xdb" * 500
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=echo, args=(listener,))
        thread.start()
        with cabled(cable_program, listener.getsockname(), loss) as cable:
            end = socket.create_connection(host_and_port(cable.locator), TIMEOUT)
            with end:
                writer = threading.Thread(target=end.sendall, args=(sent,))
                writer.start()
                got = b""
                while len(got) < len(sent):
                    portion = end.recv(4096)
                    assert portion, cable.told
                    got += portion
                writer.join()
            assert got == sent
            until(lambda: not thread.is_alive())


@settings(max_examples=20)
@given(
    st.lists(
        st.one_of(
            st.binary(max_size=600),
            st.builds(
                lambda *a: Frame(*a).to_line(),
                st.sampled_from(Kind),
                st.integers(0, 65535),
                st.integers(0, 255),
                st.binary(max_size=300),
            ),
        ),
        max_size=12,
    )
)
def test_no_bytes_on_the_line_crash_the_robots_end(
    cable_program: Path, line: list[bytes]
) -> None:
    done = subprocess.run(
        [cable_program],
        input=b"".join(line),
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0
    assert len(done.stderr.splitlines()) == 1  # its address, and no complaint


def test_golden_frames() -> None:
    made = Frame(Kind.DATA, 0xC0DB, 7, b"hi").to_line()
    assert made == b"\xc0\x01\xdb\xdd\xdb\xdc\x07hi\x9e\xfc\xf3n\xc0"
    assert frame.read(made[1:-1]) == Frame(Kind.DATA, 0xC0DB, 7, b"hi")


@given(
    st.sampled_from(Kind),
    st.integers(0, 65535),
    st.integers(0, 255),
    st.binary(max_size=frame.PAYLOAD),
    st.integers(0),
)
def test_frames_come_back_and_damaged_ones_do_not(
    kind: Kind, connection: int, number: int, payload: bytes, bit: int
) -> None:
    whole = Frame(kind, connection, number, payload).to_line()
    assert b"\xc0" not in whole[1:-1]
    assert frame.read(whole[1:-1]) == Frame(kind, connection, number, payload)
    damaged = bytearray(whole[1:-1])
    damaged[bit // 8 % len(damaged)] ^= 1 << bit % 8
    try:
        read = frame.read(bytes(damaged))
    except WireError:
        return
    # an escape that is none any more may read as the very same bytes
    assert read == Frame(kind, connection, number, payload)


def test_a_robot_that_goes_by_wifi_is_told_of(robot: Robot) -> None:
    command = [sys.executable, "-m", "rems_net", "board", "bridge", robot.port]
    done = finished(command)
    assert done.returncode == 2
    assert done.stderr == (
        f"rems: the robot at {robot.port} goes by Wi-Fi. For the cable, type: "
        f"rems board provision --port {robot.port} --router cable"
        " (R0706)\n"
    )
