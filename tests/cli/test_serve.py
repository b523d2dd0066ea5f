"""`rems router serve`: what it prints for other laptops, and what a camera reads."""

import os
import re
import shutil
import subprocess
import threading
from pathlib import Path

import pytest
import segno
from PIL import Image

from rems_net.cli.qr import draw
from rems_net.router.find import over_loopback
from rems_net.router.finding.address import from_code
from rems_net.router.finding.interfaces import reachable
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Router, free_port, until
from tests.client.programs import programs
from tests.commands import Running, Start, begun, command, environment
from tests.interrupts import interrupt

needs_address = pytest.mark.skipif(
    not reachable(), reason="this machine has no network, so no address to print"
)


def first_lines(process: Running, count: int) -> list[str]:
    """So many lines of its output, and no more is waited for."""
    assert process.stdout is not None
    return [process.stdout.readline() for _ in range(count)]


def on_a_terminal(*words: str, typed: bytes = b"", awaited: bytes = b"rems: ") -> str:
    """Return what `rems words...` shows on a terminal of 80 columns until Ctrl+C.

    typed: keys that are pressed once it is served; awaited: what it shows at the end
    """
    pty = pytest.importorskip("pty", reason="pseudo-terminals are Unix's")
    ours, theirs = pty.openpty()
    env = environment(TERM="xterm", PYTHONUTF8="1")
    stdin = theirs if typed else subprocess.DEVNULL
    process = begun(command(*words), env=env, screen=theirs, stdin=stdin)
    os.close(theirs)
    shown = bytearray()

    def read() -> None:
        try:
            while came := os.read(ours, 65536):
                shown.extend(came)
        except OSError:  # nobody has the other end any more
            pass

    reader = threading.Thread(target=read)
    reader.start()
    try:
        if typed:
            until(lambda: b"To stop all robots" in shown, 60.0)
            os.write(ours, typed)
        until(lambda: awaited in shown, 60.0)
    finally:
        interrupt(process)
        process.wait(20)
        reader.join()
        os.close(ours)
    return shown.decode().replace("\r\n", "\n")


def modules(shown: str) -> list[list[int]]:
    """The dark modules (1) of the half blocks in a text, with their quiet zone."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", shown)
    lines = [line for line in plain.splitlines() if line and not line.strip("█▀▄ ")]
    rows: list[list[int]] = []
    for line in lines:
        rows.append([int(letter in " ▄") for letter in line])
        rows.append([int(letter in " ▀") for letter in line])
    return rows[: len(rows[0])]  # the last line has half a module too many


@needs_address
def test_a_terminal_shows_the_line_to_cameras(tmp_path: Path) -> None:
    port = free_port()
    shown = on_a_terminal("router", "serve", "--listen", f"tcp/0.0.0.0:{port}")
    line = f"rems router use tcp/{reachable()[0]}:{port}"
    assert f"  {line}\n" in shown
    assert "\x1b[97;40m█" in shown  # white on black, whatever the terminal has
    code = segno.make(line, micro=False)
    found = modules(shown)
    assert found == [list(row) for row in code.matrix_iter(border=4)]
    assert all(len(row) <= 80 for row in found)
    if reader := shutil.which("zbarimg"):  # Debian's zbar-tools; a real reader
        size = len(found)
        picture = Image.new("L", (size, size), 255)
        picture.putdata([0 if dark else 255 for row in found for dark in row])
        picture.resize((8 * size, 8 * size), Image.Resampling.NEAREST).save(
            tmp_path / "seen.png"
        )
        said = subprocess.run(
            [reader, "--quiet", "--raw", str(tmp_path / "seen.png")],
            capture_output=True,
            encoding="utf-8",
            check=True,
        )
        assert said.stdout.strip() == line


@needs_address
def test_no_code_is_drawn_where_nobody_wants_it(start: Start) -> None:
    where = f"tcp/0.0.0.0:{free_port()}"
    shown = on_a_terminal("router", "serve", "--no-qr", "--listen", where)
    assert "rems router use" in shown
    assert "█" not in shown
    process = start("router", "serve", "--listen", where)  # into a pipe
    said = "".join(first_lines(process, 1 + len(reachable())))
    interrupt(process)
    said += process.communicate(timeout=20)[0]
    assert "rems router use" in said
    assert "█" not in said


def test_the_longest_line_fits() -> None:
    drawn = draw("rems router use tcp/255.255.255.255:65535")
    assert {len(line) for line in drawn.splitlines()} == {37}


@needs_address
def test_only_lines_that_lead_here(start: Start) -> None:
    """A router on one address is told by that one; its code is for port 7447."""
    address, port = reachable()[-1], free_port()
    process = start("router", "serve", "--listen", f"tcp/{address}:{port}")
    assert first_lines(process, 2) == [
        "Open fabric 'rems'. On other laptops, type one of:\n",
        f"  rems router use tcp/{address}:{port}\n",
    ]


def test_this_machine_alone(start: Start) -> None:
    process = start("router", "serve", "--listen", f"127.0.0.1:{free_port()}")
    assert first_lines(process, 1) == [
        "Open fabric 'rems'. Only this machine reaches it.\n"
    ]


def test_at_a_router_that_is_there(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As at a zenohd: the addresses are those at which it takes connections."""
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        process = start("router", "serve")
        assert first_lines(process, 1) == [
            f"Open fabric 'rems' at {router.endpoint}. Only this machine reaches it.\n"
        ]


def test_a_code_leads_to_the_address_it_was_made_of() -> None:
    assert from_code("30ag 08m6") == "192.168.1.20"


@needs_address
def test_rems_stop_goes_over_the_loopback(start: Start) -> None:
    """Where the router's own address was joined, or is in REMS_ROUTER."""
    port = free_port()
    process = start("router", "serve", "--no-qr", "--listen", f"tcp/0.0.0.0:{port}")
    first_lines(process, 1 + len(reachable()))
    session = over_loopback(f"tcp/{reachable()[0]}:{port}")
    assert session is not None
    with session:
        assert session.link.endpoint == f"tcp/127.0.0.1:{port}"
    assert over_loopback(f"tcp/192.0.2.99:{port}") is None
    assert over_loopback(f"tcp/{reachable()[0]}:{free_port()}") is None


def test_lines_at_its_terminal_stop_and_release(start: Start) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    process = start("router", "serve", "--listen", endpoint, typed=True)
    assert process.stdin is not None
    with programs() as beside:
        first_lines(process, 1)
        beside("standin.py", endpoint, "a=stands", "b=mute")
        with Session(Link(endpoint)) as session:
            box = Mailbox()
            session.watch("rems/stop", box)
            until(lambda: len(session.who("rems/robot/*/@alive")) == 2)
            for words in ("stpo", "stop"):
                process.stdin.write(f"{words}\n")
            process.stdin.flush()
            assert first_lines(process, 6) == [
                "rems: 'stpo' is unknown; expected s or r\n",
                "warning: robot/b has not answered within 0.25 s\n",
                "On rems:\n",
                "  robot/a stands at tick 412 (8.24 s): confirmed\n",
                "  robot/b has not answered: it may drive on until it is back\n",
                "Let them go on with: r (and Enter), or rems stop --release --all\n",
            ]
            assert isinstance(box.get(20.0), Mail)
        process.stdin.write("release\n")
        process.stdin.flush()
        assert first_lines(process, 2)[0] == "On rems:\n"
        process.stdin.close()  # the end of its input is not its end
        process.stdin = None
        with Session(Link(endpoint)) as session:
            assert session.ask("rems/clock/tick?format=json")


def test_a_line_on_its_terminal() -> None:
    """It is read in lines, so Ctrl+C is the terminal's still, and ends it."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    shown = on_a_terminal(
        "router", "serve", "--listen", endpoint, typed=b"s\n", awaited=b"Let "
    )
    assert "To stop all robots, type here: s (and Enter)." in shown
    assert "no robot" in shown  # is there; or no run, that early
