"""Quantities, which make fields, and units, to calculate with.

from rems_net.units import cm, deg, length, percent
length("mm", range=(0, 500))         # a field
command["wheel/left"] = 50 * percent  # a value with a unit
percent()                             # a field again: percent is both

A quantity is a function of `rems_net.defdict`; a unit is one of unyt, which is imported
when a unit is first used. `from rems_net.units import *` brings all quantities and the
common units, without `min`, which is a function of Python.
"""

import importlib
import sys
from typing import Any

from rems_net.errors import UnitError, nearest

#: quantities: functions that make fields of their kind
_QUANTITIES = """
    acceleration angle angular_acceleration angular_velocity array blob boolean
    charge choice count current force frequency integer length magnetic_field many
    mass number percent power pressure ratio resistance temperature text time torque
    velocity voltage
""".split()  # noqa: SIM905
#: the common ones of unyt's units
_COMMON = """
    m mm cm um km inch ft rad mrad deg degree rev turn rpm s ms us ns minute hr hour Hz
    kHz kg g mg N mN kN J W mW kW V mV kV A mA uA ohm K T mT uT gauss G Pa kPa bar
"""
__all__ = [*_QUANTITIES, *_COMMON.split()]


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(name)
    if name in _QUANTITIES:
        return getattr(importlib.import_module("rems_net.defdict"), name)
    unyt = importlib.import_module("unyt")
    found = getattr(unyt, name, None)
    if isinstance(found, unyt.Unit | unyt.unyt_quantity):
        return found
    try:
        return unyt.Unit(name)
    except unyt.exceptions.UnitParseError as why:
        known = (one for one in dir(unyt) if not one.startswith("_"))
        hint = nearest(name, __all__) or nearest(name, known)
        raise UnitError(f"unyt knows no unit {name!r}.{hint} (R0103)") from why


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])


class Percent:
    """Make a field of percent: `percent` is a unit and a quantity.

    Most scripts only make fields of it, and each process of a run imports its script.
    So unyt, which takes a second to import, is imported when the unit is needed.
    """

    #: Units of unyt have this attribute, too.
    is_Unit = True  # noqa: N815
    #: numpy leaves `array * percent` to this class.
    __array_ufunc__ = None

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return importlib.import_module("rems_net.defdict").percent(*args, **kwargs)

    @property
    def _unit(self) -> Any:
        return importlib.import_module("unyt").percent

    @property  # type: ignore[misc]
    def __class__(self) -> Any:
        """The class of a unit, which unyt looks for; before its import, our own."""
        return type(self._unit) if "unyt" in sys.modules else Percent

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._unit, name)

    def __add__(self, other: Any) -> Any:
        return self._unit + other  # unyt refuses it, in its own words

    def __sub__(self, other: Any) -> Any:
        return self._unit - other

    __radd__, __rsub__ = __add__, __sub__

    def __mul__(self, other: Any) -> Any:
        return self._unit * other

    def __rmul__(self, other: Any) -> Any:
        return other * self._unit

    def __truediv__(self, other: Any) -> Any:
        return self._unit / other

    def __rtruediv__(self, other: Any) -> Any:
        return other / self._unit

    def __pow__(self, power: Any) -> Any:
        return self._unit**power

    def __eq__(self, other: object) -> Any:
        return self._unit == other

    def __hash__(self) -> int:
        return hash(self._unit)

    def __reduce__(self) -> str:
        return "percent"  # pickled and copied by its name in this module

    def __str__(self) -> str:
        return str(self._unit)

    __repr__ = __str__


percent = Percent()
