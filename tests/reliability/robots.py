"""Robots that a scene can drive: their definition, driver and emulated device."""

from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
CART, WHEELS = HERE / "parts.py", HERE / "wheels.py"


@dataclass(frozen=True)
class Tried:
    """A robot of the tables.

    parts: a file with `Commander`, `FreeCommander`, `Relay` and `Model`. where: the
    option that names its line; "" for a robot without a device. emulated: a name of
    `rems board emulate`; "" for the cart of `programs/device.py`. command: what a
    program outside says, as a map.
    """

    title: str
    parts: Path
    definition: str
    driver: str
    where: str = "port"
    emulated: str = ""
    command: str = '{"wheel": {"left": 3.0, "right": 2.0}}'


ROBOTS = {
    "cart": Tried(
        "a cart",
        CART,
        f"{CART}:Cart",
        f"{CART}:Serial",
        command='{"speed": 0.5, "turn": 0.1}',
    ),
    "create2": Tried(
        "Create 2", WHEELS, "create2", f"{WHEELS}:Create2", emulated="create2"
    ),
    "dynabot": Tried(
        "Dynabot", WHEELS, "dynabot", f"{WHEELS}:Dynabot", emulated="dynabot"
    ),
    "woodbot-ws": Tried(
        "Woodbot, first firmware",
        WHEELS,
        "woodbot",
        f"{WHEELS}:WebSocketWoodbot",
        where="url",
        emulated="woodbot-ws",
    ),
    "kinematic": Tried("Kinematic", WHEELS, "woodbot", f"{WHEELS}:Modelled", where=""),
    "mujoco": Tried("MuJoCo", WHEELS, "woodbot", f"{WHEELS}:Simulated", where=""),
    # On an open fabric, by `firmware.py`: it has no driver.
    "woodbot": Tried(
        "Woodbot, own firmware", WHEELS, "woodbot", "", emulated="woodbot"
    ),
}
