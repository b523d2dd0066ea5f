"""Dictionaries with units: strict, fast, and the same on both ends of a wire."""

from rems_net.defdict.conversion.convert import Converter
from rems_net.defdict.conversion.rule import Rule
from rems_net.defdict.fields.accept import many_turns as many_turns, parse_quantity
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.makers import (
    acceleration,
    angle,
    angular_acceleration,
    angular_velocity,
    array as array,
    blob,
    boolean,
    charge,
    choice,
    count as count,
    current as current,
    force,
    frequency,
    integer,
    length,
    magnetic_field,
    many,
    mass,
    number,
    percent,
    power as power,
    pressure,
    ratio,
    resistance,
    temperature,
    text as text,
    time as time,
    torque,
    velocity,
    voltage,
)
from rems_net.defdict.schema import Schema, merge_schemas, rule
from rems_net.defdict.values.classes import (
    anew as anew,
    changed as changed,
    gather as gather,
    lock as lock,
    refill as refill,
    scatter as scatter,
    shown as shown,
)
from rems_net.defdict.values.value import DefDict
from rems_net.defdict.wire.cdr import (
    Cdr as Cdr,
    ToCdr as ToCdr,
    canonical as canonical,
    cdr as cdr,
)
from rems_net.defdict.wire.ros2msg import ros2msg as ros2msg, type_name as type_name
from rems_net.defdict.wire.rows import (
    Batch as Batch,
    RowCodec as RowCodec,
    Rows as Rows,
    row_codec as row_codec,
)

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
