"""Where Webots is looked for, on three systems, and what hides its module."""

import sys
from pathlib import Path

import pytest

from rems_net.drivers.webots.installation import installed, url
from rems_net.errors import MissingPartError, SchemaError
from tests.commands import Done, environment, finished
from tests.drivers.webots.conftest import STANDIN

NEW = Path("lib", "controller", "python", "controller")
OLD = Path("lib", "controller", f"python{sys.version_info[0]}{sys.version_info[1]}")


def install(folder: Path) -> Path:
    """An installation of today, as far as it is looked at."""
    (folder / NEW).mkdir(parents=True)
    return folder


def test_linux_and_wherever_webots_home_says(tmp_path: Path) -> None:
    there = install(tmp_path / "webots")
    found = installed({"WEBOTS_HOME": str(there)}, "linux")
    assert found == (there, there / NEW.parent)


def test_windows(tmp_path: Path) -> None:
    """For all users, or without an administrator for one."""
    places = {"PROGRAMFILES": str(tmp_path / "P"), "LOCALAPPDATA": str(tmp_path / "L")}
    mine = install(tmp_path / "L" / "Programs" / "Webots")
    assert installed(places, "win32")[0] == mine
    all_users = install(tmp_path / "P" / "Webots")
    assert installed(places, "win32")[0] == all_users


def test_macos(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if Path("/Applications/Webots.app").exists():
        pytest.skip("Webots is installed here, for all users")
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path))
    inside = install(tmp_path / "Applications" / "Webots.app" / "Contents")
    found = installed({}, "darwin")
    assert found == (tmp_path / "Applications/Webots.app", inside / NEW.parent)


def test_before_r2023a_there_was_a_module_for_each_python(tmp_path: Path) -> None:
    (tmp_path / OLD).mkdir(parents=True)
    (tmp_path / OLD / "controller.py").write_text("")
    assert installed({"WEBOTS_HOME": str(tmp_path)}, "linux")[1] == tmp_path / OLD


def test_it_is_nowhere(tmp_path: Path) -> None:
    nowhere = {"PROGRAMFILES": str(tmp_path)}
    with pytest.raises(MissingPartError) as caught:
        installed(nowhere, "win32")
    assert str(caught.value) == (
        f"Webots is not installed where it usually is: {tmp_path / 'Webots'}. Install "
        "it from https://cyberbotics.com, or set WEBOTS_HOME to its folder. (R0315)"
    )
    with pytest.raises(MissingPartError) as caught:
        installed({"WEBOTS_HOME": str(tmp_path)}, "linux")
    assert str(caught.value) == (
        f"WEBOTS_HOME is {str(tmp_path)!r}, and there is no Webots in that folder "
        "(looked for lib/controller/python). Set it to where Webots is installed, "
        f"such as {Path('/usr/local/webots')}, or unset it. (R0315)"
    )


@pytest.mark.parametrize(
    ("where", "robot", "told"),
    [
        ("", "", ""),
        ("", "woodbot", "woodbot"),
        ("", "Pioneer 3-DX", "Pioneer%203-DX"),
        ("tcp://192.168.1.2:1234", "a/b", "tcp://192.168.1.2:1234/a%2Fb"),
        ("ipc://1235/", "e-puck", "ipc://1235/e-puck"),
        ("ipc://1235", "", "ipc://1235"),
    ],
)
def test_what_webots_is_told(where: str, robot: str, told: str) -> None:
    assert url(where, robot) == told


def test_a_url_that_is_none() -> None:
    with pytest.raises(SchemaError, match=r"url is '192\.168\.1\.2'; expected where"):
        url("192.168.1.2", "woodbot")


def imported(folder: Path) -> Done:
    """Import Webots' module in a process of its own, which was started there."""
    code = (
        "from rems_net.drivers.webots.installation import controller\n"
        "try:\n    print(controller().__file__)\n"
        "except ImportError as why:\n    print(why)\n"
    )
    return finished(
        [sys.executable, "-c", code], folder, environment(WEBOTS_HOME=str(STANDIN))
    )


def test_the_module_is_webots_own(tmp_path: Path) -> None:
    (tmp_path / "controllers").mkdir()
    (tmp_path / "controller").mkdir()  # a plain folder gives way
    done = imported(tmp_path)
    assert (done.stdout.strip(), done.stderr) == (
        str(STANDIN / NEW / "__init__.py"),
        "",
    )


def test_a_module_of_that_name_is_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "controller.py").write_text("")
    done = imported(tmp_path)
    assert done.stdout.strip() == (
        f"{tmp_path / 'controller.py'} is in the way: Webots has a module of the name "
        "'controller', too, and Python takes the first one. Give yours another name, "
        "or, if pip installed it, type: pip uninstall controller (R0302)"
    )


def test_a_module_that_cannot_be_loaded(tmp_path: Path) -> None:
    there = install(tmp_path / "webots")
    (there / NEW / "__init__.py").write_text('raise OSError("no libController.so")')
    code = (
        "from rems_net.drivers.webots.installation import controller\n"
        "try:\n    controller()\n"
        "except ImportError as why:\n    print(why)\n"
    )
    done = finished(
        [sys.executable, "-c", code], env=environment(WEBOTS_HOME=str(there))
    )
    assert done.stdout.startswith(
        f"Webots is in {there}, and its Python module cannot be loaded: no libCont"
    ), done.stderr
