"""A program of ROBOTIS's own kind, on an emulated bus: its classes, as they are."""

from pathlib import Path
from typing import Any

import pytest

from rems_net.drivers.hardware.dynamixel import table
from rems_net.emulators.dynamixel.robots import DynabotServos
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from tests.agents.runs import until

sdk: Any = pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
pytest.importorskip("pty", reason="there are no pseudo-terminals here")

SPEED, WHERE = table.GOAL_VELOCITY, table.PRESENT_POSITION


def test_a_program_that_drives_two_wheels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It asks once, and a machine that is busy with other tests may take long.
    monkeypatch.setattr(sdk.port_handler, "LATENCY_TIMER", 100)
    with Emulator(DynabotServos(), Terminal(tmp_path / "ttyUSB0")) as emulator:
        port, packets = sdk.PortHandler(emulator.where), sdk.PacketHandler(2.0)
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        done = sdk.COMM_SUCCESS, 0
        try:
            assert packets.ping(port, 1) == (1060, *done)
            assert packets.ping(port, 3)[1] == sdk.COMM_RX_TIMEOUT
            found, _ = packets.broadcastPing(port)
            assert found == {1: [1060, 45], 2: [1060, 45]}
            for servo in found:
                for register, value in (
                    (table.OPERATING_MODE, table.VELOCITY_MODE),
                    (table.TORQUE, 1),
                ):
                    at = register.address
                    assert packets.write1ByteTxRx(port, servo, at, value) == done
            # Without torque only.
            at = table.OPERATING_MODE.address
            assert packets.write1ByteTxRx(port, 1, at, 3) == (sdk.COMM_SUCCESS, 7)
            write = sdk.GroupSyncWrite(port, packets, SPEED.address, SPEED.size)
            write.addParam(2, SPEED.pack(83))
            write.addParam(1, SPEED.pack(-83))
            assert write.txPacket() == sdk.COMM_SUCCESS
            read = sdk.GroupSyncRead(port, packets, WHERE.address, WHERE.size)
            read.addParam(2)
            read.addParam(1)

            def moved(servo: int) -> int:
                assert read.txRxPacket() == sdk.COMM_SUCCESS
                return int(read.getData(servo, WHERE.address, WHERE.size))

            until(lambda: moved(2) > 2148)
            # As unsigned numbers, whatever they mean.
            until(lambda: moved(1) < 1948 or moved(1) > 1 << 31)
            assert emulator.device.robot.state.x > 0.003
            assert packets.reboot(port, 1) == done
            # It answers for a moment before it goes.
            at = table.TORQUE.address
            until(lambda: packets.read1ByteTxRx(port, 1, at) == (0, *done))
        finally:
            port.closePort()
