"""The models of Webots that the stand-in is told, by what Webots' own pages call them.

Sources: the class's world (Lab 2); the guides and the controllers that come with
Webots for Create, E-puck, Pioneer 3-DX, Pioneer 3-AT, Moose and youBot.
"""

from typing import Any

from rems_net.agents.robot import Definition
from rems_net.robots.create2 import Create2
from rems_net.robots.epuck import Epuck
from rems_net.robots.moose import Moose
from rems_net.robots.pioneer import Pioneer3AT, Pioneer3DX
from rems_net.robots.woodbot import Woodbot
from rems_net.robots.youbot import YoubotBase

WHEEL, JOINT = range(1, 5), range(1, 6)


def angles(left: str, right: str) -> dict[str, Any]:
    """Position sensors of two wheels, called as the motors, with other endings."""
    return {
        f"{motor.removesuffix(' motor')} sensor": {"angle": motor}
        for motor in (left, right)
    }


SONARS = {f"so{number}": {"value": 512.0} for number in range(16)}

WOODBOT = {
    "name": "woodbot",
    "upright": "y",
    "at": [-0.01425, -0.0063, 0.0],
    "radius": 0.02,
    "track": 0.1126,
    "left": ["motor_r"],
    "right": ["motor_l"],
    "sensors": {
        "lidar_f": {"lidar": [1.0, 0.0, 0.00825]},
        "lidar_r": {"lidar": [0.0, -1.0, -0.03575]},
        "mag_x": {"compass": [0]},
        "mag_y": {"compass": [2]},
        "gyro_z": {"gyro": [1]},
    },
}
WHEELS = {"left": ["left wheel motor"], "right": ["right wheel motor"]}
CREATE = {
    "name": "Create",
    "radius": 0.036,
    "track": 0.235,
    **WHEELS,
    "max_speed": 16.129,
    "sensors": {
        **angles("left wheel motor", "right wheel motor"),
        "bumper_left": {"value": 1.0},
        "bumper_right": {"value": 0.0},
        "cliff_left": {"value": 20.0},
        "cliff_front_left": {"value": 4000.0},
        "cliff_front_right": {"value": 4000.0},
        "cliff_right": {"value": 4000.0},
    },
}
EPUCK = {
    "name": "e-puck",
    "radius": 0.02,
    "track": 0.052,
    **WHEELS,
    "max_speed": 6.28,
    "sensors": {
        **angles("left wheel motor", "right wheel motor"),
        **{f"ps{number}": {"value": 270.5} for number in range(8)},
        "accelerometer": {"accelerometer": [0, 1, 2]},
        "gyro": {"gyro": [0, 1, 2]},
    },
}
PIONEER_3DX = {
    "name": "Pioneer 3-DX",
    "radius": 0.0975,
    "track": 0.33,
    "left": ["left wheel"],
    "right": ["right wheel"],
    "max_speed": 12.3,
    "sensors": {**angles("left wheel", "right wheel"), **SONARS},
}
PIONEER_3AT = {
    "name": "Pioneer 3-AT",
    "radius": 0.11,
    "track": Pioneer3AT.parameters.schema().effective_track,
    "left": ["front left wheel", "back left wheel"],
    "right": ["front right wheel", "back right wheel"],
    "max_speed": 6.4,
    "sensors": {**angles("front left wheel", "front right wheel"), **SONARS},
}
MOOSE = {
    "name": "moose",
    "at": [-0.075, 0.0, -0.06],
    "radius": 0.3175,
    "track": Moose.parameters.schema().effective_track,
    "left": [f"left motor {number}" for number in range(1, 5)],
    "right": [f"right motor {number}" for number in range(1, 5)],
    "max_speed": 26.0,
    "sensors": {"compass": {"compass": [0, 1, 2]}, "gyro": {"gyro": [0, 1, 2]}},
}
YOUBOT = {
    "name": "youBot",
    "at": [0.0, 0.0, -0.055],
    "radius": 0.05,
    "track": 0.316,
    "wheelbase": 0.456,
    "left": ["wheel2", "wheel4"],
    "right": ["wheel1", "wheel3"],
    "places": [*(f"arm{number}" for number in JOINT), "finger::left"],
    "max_speed": 14.81,
    "sensors": {
        **{f"wheel{number}sensor": {"angle": f"wheel{number}"} for number in WHEEL},
        **{f"arm{number}sensor": {"angle": f"arm{number}"} for number in JOINT},
    },
}
MODELS: list[tuple[type[Definition], dict[str, Any]]] = [
    (Woodbot, WOODBOT),
    (Create2, CREATE),
    (Epuck, EPUCK),
    (Pioneer3DX, PIONEER_3DX),
    (Pioneer3AT, PIONEER_3AT),
    (Moose, MOOSE),
    (YoubotBase, YOUBOT),
]


def spec(model: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A model, with a world of 2 ms around it."""
    return {"step": 2, "at": [0.0, 0.0, 0.0], **model, **more}
