"""The units of unyt, imported only when one is used.

from rems_net.units import cm, deg, percent
command["wheel/left"] = 50 * percent

`from rems_net.units import *` brings the common ones, without `min`, which is a
function of Python, and `percent`, which is a field in `rems_net.defdict`.
"""

import importlib
from typing import Any, NoReturn

from rems_net.errors import UnitError, nearest

#: of the names that unyt knows as a unit, those that are used all day
_COMMON = """
    m mm cm um km inch ft rad mrad deg degree rev turn rpm s ms us ns minute hr hour Hz
    kHz kg g mg N mN kN J W mW kW V mV kV A mA uA ohm K T mT uT gauss G Pa kPa bar
"""
__all__ = _COMMON.split()


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(name)
    unyt = importlib.import_module("unyt")
    if name == "percent":
        return type("Percent", (unyt.Unit,), {"__call__": _no_field})(name)
    found = getattr(unyt, name, None)
    if isinstance(found, unyt.Unit | unyt.unyt_quantity):
        return found
    try:
        return unyt.Unit(name)
    except unyt.exceptions.UnitParseError as why:
        hint = nearest(name, (one for one in dir(unyt) if not one.startswith("_")))
        raise UnitError(f"unyt knows no unit {name!r}.{hint}") from why


def _no_field(self: object, *_: object, **__: object) -> NoReturn:
    raise UnitError(
        "percent of rems_net.units is a unit, as in 50 * percent. To make a field, "
        "take percent() of rems_net.defdict: from rems_net.defdict import percent"
    )
