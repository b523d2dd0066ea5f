"""Dictionaries with units: strict, fast, and the same on both ends of a wire."""

from rems_net.defdict.conversion.convert import Converter
from rems_net.defdict.conversion.rule import Rule
from rems_net.defdict.fields.accept import many_turns as many_turns
from rems_net.defdict.fields.accept import parse_quantity
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.makers import (
    acceleration,
    angle,
    angular_acceleration,
    angular_velocity,
    blob,
    boolean,
    charge,
    choice,
    force,
    frequency,
    integer,
    length,
    magnetic_field,
    many,
    mass,
    number,
    percent,
    pressure,
    ratio,
    resistance,
    temperature,
    torque,
    velocity,
    voltage,
)
from rems_net.defdict.fields.makers import array as array
from rems_net.defdict.fields.makers import count as count
from rems_net.defdict.fields.makers import current as current
from rems_net.defdict.fields.makers import power as power
from rems_net.defdict.fields.makers import text as text
from rems_net.defdict.fields.makers import time as time
from rems_net.defdict.rule import rule
from rems_net.defdict.schema import Schema, merge_schemas
from rems_net.defdict.values.classes import anew as anew
from rems_net.defdict.values.classes import changed as changed
from rems_net.defdict.values.classes import gather as gather
from rems_net.defdict.values.classes import lock as lock
from rems_net.defdict.values.classes import refill as refill
from rems_net.defdict.values.classes import scatter as scatter
from rems_net.defdict.values.classes import shown as shown
from rems_net.defdict.values.value import DefDict
from rems_net.defdict.wire.cdr import Cdr as Cdr
from rems_net.defdict.wire.cdr import ToCdr as ToCdr
from rems_net.defdict.wire.cdr import canonical as canonical
from rems_net.defdict.wire.cdr import cdr as cdr
from rems_net.defdict.wire.ros2msg import ros2msg as ros2msg
from rems_net.defdict.wire.ros2msg import type_name as type_name
from rems_net.defdict.wire.rows import Batch as Batch
from rems_net.defdict.wire.rows import RowCodec as RowCodec
from rems_net.defdict.wire.rows import Rows as Rows
from rems_net.defdict.wire.rows import row_codec as row_codec

__all__ = [
    "Converter",
    "DefDict",
    "Field",
    "Rule",
    "Schema",
    "acceleration",
    "angle",
    "angular_acceleration",
    "angular_velocity",
    "blob",
    "boolean",
    "charge",
    "choice",
    "force",
    "frequency",
    "integer",
    "length",
    "magnetic_field",
    "many",
    "mass",
    "merge_schemas",
    "number",
    "parse_quantity",
    "percent",
    "pressure",
    "ratio",
    "resistance",
    "rule",
    "temperature",
    "torque",
    "velocity",
    "voltage",
]
