"""The units of unyt, imported only when one is used.

from rems_net.units import cm, deg, percent
command["wheel/left"] = 50 * percent
"""

from __future__ import annotations

import importlib
from typing import Any

from rems_net.errors import UnitError, nearest

__all__: list[str] = []  # any name that unyt knows as a unit


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(name)
    unyt = importlib.import_module("unyt")
    found = getattr(unyt, name, None)
    if isinstance(found, unyt.Unit | unyt.unyt_quantity):
        return found
    try:
        return unyt.Unit(name)
    except unyt.exceptions.UnitParseError as why:
        hint = nearest(name, (one for one in dir(unyt) if not one.startswith("_")))
        raise UnitError(f"unyt knows no unit {name!r}.{hint}") from why
