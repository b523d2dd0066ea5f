"""Mathematics that gives the same bits on every computer.

`math.sin` and `numpy.sin` depend on the C library and the processor: the last bit of a
result differs from one laptop to the next, and so does a recording. These functions use
only +, -, *, / and square roots, for each of which IEEE 754 allows only one result. A
number gives a float; an array gives an array, with the same bits for each element.

Results are less than 1 ulp (the distance to the next float) from the true value.
"""

from rems_net.maths.growth import exp, log
from rems_net.maths.plane import atan2, hypot
from rems_net.maths.turns import cos, sin, sincos, tan

__all__ = ["atan2", "cos", "exp", "hypot", "log", "sin", "sincos", "tan"]
