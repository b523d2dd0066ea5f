"""Table: units that robots often use, as exact numbers, with what each measures.

The tests compare every one of them with unyt.
"""

# Powers of (length, mass, time, current, temperature, angle), or unyt's own words.
Dimension = tuple[int, ...] | str

NONE: tuple[int, ...] = (0, 0, 0, 0, 0, 0)
DIMENSIONS: dict[str, tuple[int, ...]] = {
    "length": (1, 0, 0, 0, 0, 0),
    "angle": (0, 0, 0, 0, 0, 1),
    "velocity": (1, 0, -1, 0, 0, 0),
    "angular velocity": (0, 0, -1, 0, 0, 1),
    "acceleration": (1, 0, -2, 0, 0, 0),
    "angular acceleration": (0, 0, -2, 0, 0, 1),
    "mass": (0, 1, 0, 0, 0, 0),
    "time": (0, 0, 1, 0, 0, 0),
    "frequency": (0, 0, -1, 0, 0, 0),
    "force": (1, 1, -2, 0, 0, 0),
    "torque": (2, 1, -2, 0, 0, 0),
    "power": (2, 1, -3, 0, 0, 0),
    "voltage": (2, 1, -3, -1, 0, 0),
    "current": (0, 0, 0, 1, 0, 0),
    "resistance": (2, 1, -3, -2, 0, 0),
    "temperature": (0, 0, 0, 0, 1, 0),
    "pressure": (-1, 1, -2, 0, 0, 0),
    "magnetic field": (0, 1, -2, -1, 0, 0),
    "charge": (0, 0, 1, 1, 0, 0),
    "plain number": NONE,
}
# Units without a size of their own: a value stands for a place in a range.
RELATIVE = {"percent": 100.0, "ratio": 1.0, "count": None}
# Units with a zero of their own: the table has their dimension, unyt the rest.
SHIFTED = {"degC": "temperature", "degF": "temperature"}

# Words that are no units, and the units that people mean by them.
SAID = {
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("mins", "minutes"), "min"),
    **dict.fromkeys(("meters", "metres", "metre", "meter"), "m"),
    **dict.fromkeys(("cms", "centimeters", "centimetres"), "cm"),
    **dict.fromkeys(("mms", "millimeters", "millimetres"), "mm"),
    **dict.fromkeys(("degs", "degrees"), "deg"),
    **dict.fromkeys(("rads", "radian", "radians"), "rad"),
    **dict.fromkeys(("revolution", "revolutions", "turns"), "rev"),
    **dict.fromkeys(("kmh", "kph"), "km/h"),
    **dict.fromkeys(("pct", "percents"), "percent"),
    "mps": "m/s",
    "volts": "V",
    "feet": "ft",
    "inches": "inch",
}

TABLE: dict[str, tuple[str, str, int]] = {
    # name: (dimension, exact size in SI, power of pi)
    "m": ("length", "1", 0),
    "mm": ("length", "1/1000", 0),
    "cm": ("length", "1/100", 0),
    "um": ("length", "1/1000000", 0),
    "km": ("length", "1000", 0),
    "inch": ("length", "0.0254", 0),
    "ft": ("length", "0.3048", 0),
    "rad": ("angle", "1", 0),
    "mrad": ("angle", "1/1000", 0),
    "deg": ("angle", "1/180", 1),
    "degree": ("angle", "1/180", 1),
    "rev": ("angle", "2", 1),
    "turn": ("angle", "2", 1),
    "rpm": ("angular velocity", "1/30", 1),
    "s": ("time", "1", 0),
    "ms": ("time", "1/1000", 0),
    "us": ("time", "1/1000000", 0),
    "ns": ("time", "1/1000000000", 0),
    "min": ("time", "60", 0),
    "minute": ("time", "60", 0),
    "hr": ("time", "3600", 0),
    "hour": ("time", "3600", 0),
    "Hz": ("frequency", "1", 0),
    "kHz": ("frequency", "1000", 0),
    "kg": ("mass", "1", 0),
    "g": ("mass", "1/1000", 0),
    "mg": ("mass", "1/1000000", 0),
    "N": ("force", "1", 0),
    "mN": ("force", "1/1000", 0),
    "kN": ("force", "1000", 0),
    "J": ("torque", "1", 0),
    "W": ("power", "1", 0),
    "mW": ("power", "1/1000", 0),
    "kW": ("power", "1000", 0),
    "V": ("voltage", "1", 0),
    "mV": ("voltage", "1/1000", 0),
    "kV": ("voltage", "1000", 0),
    "A": ("current", "1", 0),
    "mA": ("current", "1/1000", 0),
    "uA": ("current", "1/1000000", 0),
    "ohm": ("resistance", "1", 0),
    "K": ("temperature", "1", 0),
    "T": ("magnetic field", "1", 0),
    "mT": ("magnetic field", "1/1000", 0),
    "uT": ("magnetic field", "1/1000000", 0),
    # unyt's gauss belongs to another system, with another dimension.
    "gauss": ("magnetic field", "1/10000", 0),
    "G": ("magnetic field", "1/10000", 0),
    "Pa": ("pressure", "1", 0),
    "kPa": ("pressure", "1000", 0),
    "bar": ("pressure", "100000", 0),
}
