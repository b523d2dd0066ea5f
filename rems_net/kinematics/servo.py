"""Servo joints: they go to a target at a speed, and halt there."""

from typing import Any

import numpy as np


def toward(position: Any, target: Any, most: Any) -> Any:
    """Return a joint's position after a move of at most `most` towards its target.

    It halts at the target, to the last bit. Arrays give arrays. rad, or m for a slide.
    """
    missing = target - position
    if isinstance(missing, float):
        if abs(missing) <= most:
            return target
        return position + most if missing > 0 else position - most
    gone = position + np.where(missing > 0, most, -most)
    return np.where(np.abs(missing) <= most, target, gone)


def speed_toward(position: Any, target: Any, speed: Any) -> Any:
    """Return a joint's speed towards its target, rad/s; 0 if it is there."""
    missing = target - position
    if isinstance(missing, float):
        return speed if missing > 0 else -speed if missing < 0 else 0.0
    return speed * np.sign(missing)
