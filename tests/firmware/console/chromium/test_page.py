"""The page of deploy/provision in Chromium, at a robot's own firmware."""

from collections.abc import Callable
from pathlib import Path

from rems_net.cable.frame import Frame, Kind
from tests.firmware.console.chromium.browser import Page
from tests.firmware.console.test_browser import PAGE

Show = Callable[[str], Page]
LOG = "document.getElementById('log').textContent"
READY = "!document.getElementById('fields').disabled"


def test_a_robot_is_set_up(show: Show, tmp_path: Path) -> None:
    page = show(PAGE.as_uri())
    page.click("connect")
    page.until(READY)
    assert "woodbot: rems_net woodbot 0.1.0 on posix" in page.tab.run(LOG)
    for field, text in (("name", "woodbot-7"), ("password", "wrong horse")):
        page.tab.run(f"document.getElementById('{field}').value = '{text}'")
    page.tab.run("document.getElementById('ssid').value = 'lab-net'")
    page.tab.run("document.querySelector('form button').click()")
    page.until(f"{LOG}.includes('the password, or the user, is wrong')")
    assert page.tab.run("document.getElementById('password').value") == ""
    page.tab.run("document.getElementById('password').value = 'correct horse'")
    page.tab.run("document.querySelector('form button').click()")
    page.until(f"{LOG}.includes('robot/woodbot-7 on rems')")
    assert "joined lab-net" in page.tab.run(LOG)
    assert "horse" not in page.tab.run(LOG)
    assert b"ssid=lab-net\n" in page.robot.settings.read_bytes()
    page.tab.picture(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 10_000


def test_a_robot_that_speaks_faster(show: Show) -> None:
    """It has the cable for a network: at the console's usual speed all is noise."""
    page = show(PAGE.as_uri())
    page.robots_baud = 921_600
    page.chatter = Frame(Kind.DATA, 1, 0, b"a session's first packet").to_line()
    page.click("connect")
    page.until(f"{LOG}.includes('woodbot: rems_net woodbot')")
    assert "FramingError" in page.errors
    assert "pulled" not in page.tab.run(LOG)
    page.until(READY)


def test_noise_while_it_answers(show: Show) -> None:
    """Each error that Web Serial lets a page go on after, and bytes of noise."""
    page = show(PAGE.as_uri())
    page.click("connect")
    page.until(READY)
    for error in ("BreakError", "FramingError", "ParityError", "BufferOverrunError"):
        page.tab.run(
            "cable.receive([0xc0, 0x49, 0x4d, 0x50, 0x52, 0x4f, 0x56, 1, 0xff])"
        )
        page.tab.run(f"cable.fail('{error}')")
        page.tab.run(f"{LOG} = ''")
        page.click("status")
        page.until(f"{LOG}.includes('robot/woodbot on rems')")


def test_noise_without_an_error(show: Show) -> None:
    """The first byte of a frame, and nothing behind it: what follows is understood."""
    page = show(PAGE.as_uri())
    page.click("connect")
    page.until(READY)
    page.tab.run("cable.receive([0xc0]); window.noise = performance.now()")
    page.until("performance.now() > window.noise + 600")
    page.click("status")
    page.until(f"{LOG}.includes('robot/woodbot on rems')")


def test_a_cable_that_is_pulled(show: Show) -> None:
    page = show(PAGE.as_uri())
    page.click("connect")
    page.until(READY)
    page.tab.run("cable.pull()")
    page.click("status")
    page.until(f"{LOG}.includes('the cable was pulled out')")
    assert not page.tab.run(READY)
