"""zenohd.json5: the settings of our own router, tried with a real zenohd."""

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest
import zenoh

from rems_net.router.finding.address import PORT
from rems_net.router.settings import Link
from rems_net.router.stop_store import LEASE
from tests.agents.runs import free_port, until
from tests.pages import rems, started

#: what the gate does in our own router's place, and what stands between it and Zenoh
OF_THE_GATE = ("scouting/multicast/enabled", "transport/link/tcp/so_sndbuf")
ZENOHD = Path(__file__).parents[2] / "deploy" / "zenohd.json5"


def leaves(tree: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Each `a/b/c` of nested tables, and what is there."""
    if isinstance(tree, dict) and tree:
        for name, inner in tree.items():
            yield from leaves(inner, f"{path}/{name}" if path else name)
    else:
        yield path, tree


def test_zenohd_is_told_what_our_own_router_is() -> None:
    config = zenoh.Config.from_file(ZENOHD)  # what Zenoh does not know is refused
    listen = f"tcp/0.0.0.0:{PORT}"
    ours = Link(listen, serve=True, lease=LEASE, behind=listen)
    # Zenoh adds what is left out of a list's tables, so that both go through it.
    expected = zenoh.Config.from_json5(ours.to_wire())
    for path, _ in leaves(json.loads(ours.to_wire())):
        if path in OF_THE_GATE:
            continue
        found, value = config.get_json(path), expected.get_json(path)
        assert json.loads(found) == json.loads(value), path


@contextmanager
def zenohd(port: int, log: Path) -> Iterator[None]:
    """The real zenohd, with this configuration at another port."""
    listen = json.dumps([f"tcp/127.0.0.1:{port}"])
    with log.open("wb") as said:
        process = subprocess.Popen(
            ["zenohd", "-c", ZENOHD, "--cfg", f"listen/endpoints:{listen}"],
            stdout=said,
            stderr=subprocess.STDOUT,
        )
        try:
            yield
        finally:
            process.terminate()
            process.wait(20)


@contextmanager
def zenoh_in_python(port: int, log: Path) -> Iterator[None]:
    """The router of the wheel, with this configuration at another port."""
    config = zenoh.Config.from_file(ZENOHD)
    config.insert_json5("listen/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    log.touch()
    with zenoh.open(config):
        yield


needs_zenohd = pytest.mark.skipif(
    shutil.which("zenohd") is None, reason="there is no zenohd: cargo install zenohd"
)


@pytest.mark.parametrize(
    "router", [zenoh_in_python, pytest.param(zenohd, marks=needs_zenohd)]
)
def test_a_class_is_served_on_zenohd(
    router: Callable[[int, Path], AbstractContextManager[None]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port = free_port()
    with router(port, tmp_path / "log"):
        monkeypatch.setenv("REMS_ROUTER", f"tcp/127.0.0.1:{port}")
        until(lambda: "it is a router" in rems(tmp_path, "rems why").stdout, 60.0)
        with started(tmp_path, "rems router serve") as clock:
            assert clock.stdout is not None
            assert clock.stdout.readline() == (
                f"Open fabric 'rems' at tcp/127.0.0.1:{port}. Only this machine "
                "reaches it.\n"
            )
            with started(
                tmp_path, "rems agent start robot woodbot kinematic --name alice"
            ):
                until(lambda: "robot/alice" in rems(tmp_path, "rems list").stdout, 60.0)
            assert rems(tmp_path, "rems why").returncode == 0
    assert "ERROR" not in (tmp_path / "log").read_text()
