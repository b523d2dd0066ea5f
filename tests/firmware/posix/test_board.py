"""What the board itself does: its watchdog, brown-outs, settings and names of hosts."""

import subprocess
import time
from pathlib import Path

import pytest

import rems_net
from tests.commands import finished
from tests.firmware.posix.faults import STANDS, TIMEOUT
from tests.firmware.posix.scene import NAME, Scene
from tests.reliability.rig.programs import Program, until


def test_a_motors_task_that_hangs_is_reset_by_the_watchdog(scene: Scene) -> None:
    scene.serve()
    robot = scene.start()
    scene.drive()
    at = time.monotonic()
    assert robot.control("hang motors 60000") == "ok"
    assert robot.stood(at, TIMEOUT) - at <= STANDS + 0.4, "20 looks of 20 ms"
    stood = robot.pulses()[-1].at
    robot.moved(stood, TIMEOUT)  # it has started again, and is driven


@pytest.mark.parametrize("why", ["brownout", "crash"])
def test_it_comes_up_stopped_and_joins_again(scene: Scene, why: str) -> None:
    scene.serve()
    robot = scene.start()
    scene.drive()
    with rems_net.join(at=scene.endpoint) as fabric:
        until(lambda: fabric.robot(NAME).state.x > 0, "going", TIMEOUT)
        scene.stop_driving()
        at = time.monotonic()
        robot.process.tell(f"reset {why}")
        robot.stood(at, TIMEOUT)
        # The odometry is new, as after each start, and nobody drives it.
        until(lambda: fabric.robot(NAME).state.x == 0, "the robot", TIMEOUT)
        assert all(one.stands for one in robot.pulses() if one.at > at + STANDS)


def test_a_link_that_hangs_does_not_hold_up_the_motors(scene: Scene) -> None:
    scene.serve()
    robot = scene.start()
    scene.drive()
    at = time.monotonic()
    assert robot.control("hang link 4000") == "ok"
    assert robot.stood(at, TIMEOUT) - at <= STANDS
    robot.moved(at + 3.0, TIMEOUT)


def test_it_comes_when_its_password_is_right_at_last(scene: Scene) -> None:
    scene.serve()
    words = ["--do", "air LAB other", "--set", "ssid=LAB", "--set", "password=secret"]
    robot = scene.start(*words)
    for line in ("air OTHER secret", "air LAB secret"):
        assert robot.control(line) == "ok"
    scene.drive()


def test_it_comes_when_its_name_resolves_at_last(scene: Scene) -> None:
    scene.serve()
    named = scene.endpoint.replace("127.0.0.1", "localhost")
    robot = scene.start("--do", "names off", router=named)
    assert robot.control("names on") == "ok"
    scene.drive()


def test_settings_are_kept_and_options_come_first(scene: Scene) -> None:
    file = scene.rig.folder / "bot.settings"

    def start(*words: str) -> Program:
        told = [str(scene.program), "--settings", str(file), "--console", "-", *words]
        return scene.rig.start("bot", told)

    bot = start()
    bot.wait_for("Type help")
    for line in ("set name woodbot-9", "set left_trim 12"):
        assert bot.ask(line).strip() == "ok"
    bot.kill()
    assert file.stat().st_mode & 0o077 == 0, "a password may be in it"
    bot = start("--name", "woodbot-8")
    bot.tell("get")
    bot.wait_for("^name woodbot-8")
    bot.wait_for("^left_trim 12")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--nmae", "x"], "there is no such option"),
        (["--name"], "expects a value"),
        (["--router", "http://x"], "expected tcp/ADDRESS:PORT"),
        (["--set", "trim"], "expected NAME=VALUE"),
        (["--do", "part nose absent"], "no such line"),
    ],
)
def test_mistakes_are_told_in_words(
    woodbot: Path, words: list[str], sentence: str
) -> None:
    done = finished([woodbot, *words], seconds=20.0)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "password" not in done.stderr


def test_help_fits_a_terminal(woodbot: Path) -> None:
    done = subprocess.run(
        [woodbot, "--help"], capture_output=True, text=True, timeout=20.0, check=True
    )
    assert "examples:" in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 80
