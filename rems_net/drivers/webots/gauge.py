"""Gauge: a sensor of Webots' robot, read as the field that it fills."""

from __future__ import annotations

from math import isnan, nan
from typing import Any

import numpy as np

from rems_net.defdict import Field
from rems_net.worlds.devices import Reading


class Gauge:
    """A device, what the definition says of it, and the field."""

    def __init__(self, device: Any, reading: Reading, field: Field):
        self.device, self.reading, self._field = device, reading, field
        self._table = np.array(sorted(reading.table)).T
        self._from = self._base = 0.0
        self._mark = nan

    def mark(self) -> None:
        """Remember what it shows, since it will be put back to that."""
        self._mark = self._number()

    def begin(self, value: float, *, marked: bool = False) -> None:
        """Count from here on: what it shows now is `value` of the field.

        marked: it was put back, and will show what was remembered from the next step on
        """
        number = self._mark if marked else self._number()
        if self.reading.counted and not isnan(number):
            self._from, self._base = value, number

    def read(self) -> float | bool | None:
        """Return the field's value; None where the device shows none."""
        reading = self.reading
        number = self._number()
        if isnan(number):
            return None  # of an axis that is switched off
        if reading.counted:
            passed = reading.factor * (number - self._base)
            # Its last digits tell how far it had turned before: no two runs agree.
            value = self._from + round(passed, 9)
        elif reading.table:
            value = float(np.interp(number, *self._table))
        else:
            value = reading.factor * number + reading.offset
        if self._field.dtype == "bool":
            return value > 0.5
        low, high = self._field.limits
        # Webots adds noise to what is read at the ends of a range, too.
        return min(max(round(value) if self._field.whole else value, low), high)

    def _number(self) -> float:
        part = self.reading.part
        if part is None:
            return float(self.device.getValue())
        return float(self.device.getValues()[part])
