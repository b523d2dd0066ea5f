"""A robot that is really driven, lent: the older of two clocks stops it."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.fabric import Fabric, join
from tests.agents.runs import Router, until
from tests.cli.lending.conftest import stands
from tests.commands import ROOT, Run, Start
from tests.drivers.hardware.cart import Device

#: waiting for real clocks, too much for every run of the tests
pytestmark = pytest.mark.slow


def test_a_cart_that_is_really_driven(
    start: Start, rems: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stands still in between, at STOP of either, and without either's ticks."""
    parts = ROOT / "tests" / "drivers" / "hardware" / "parts.py"
    with Device(tmp_path) as device, Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        clock = start("serve")
        start("serve", "--fabric", "team3")
        agent = ("agent", "robot", f"{parts}:Cart", f"{parts}:SerialCart")
        start(*agent, "--name", "cart", "--set", f"options.port={device.link}")
        with join("rems") as home, join("team3") as team:
            goes(home, device)
            until(lambda: rems("lend", "robot/cart", "team3").returncode == 0)
            until(lambda: device.speed == 0.0)
            told = len(device.heard())
            until(lambda: len(device.heard()) > told + 20)
            assert {n["heard"][0] for n in device.heard()[told:]} == {0.0}
            goes(team, device)
            assert stands(home, "cart")
            stays(team, device)
            home.release()
            goes(team, device)
            clock.send_signal(signal.SIGSTOP)
            try:
                until(lambda: tell(team) or device.speed == 0.0)
                stays(team, device)
            finally:
                clock.send_signal(signal.SIGCONT)
            goes(team, device)
            assert rems("return", "robot/cart").returncode == 0
            until(lambda: device.speed == 0.0)
            goes(home, device)


def tell(fabric: Fabric) -> bool:
    fabric.robot("cart").command["speed"] = 0.5
    return False


def goes(fabric: Fabric, device: Device) -> None:
    """Tell the cart to go until it does."""

    def told() -> bool:
        try:
            tell(fabric)
        except FabricError:  # it is not there yet
            return False
        return device.speed == 0.5

    until(told)


def stays(fabric: Fabric, device: Device) -> None:
    """Tell it to go, and see that it does not."""
    told = len(device.heard())
    until(lambda: tell(fabric) or len(device.heard()) > told + 30)
    assert {n["heard"][0] for n in device.heard()[told:]} == {0.0}
