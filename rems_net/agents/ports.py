"""Ports and settings of an agent: what it writes, reads and is configured with.

All three are class attributes, so a typo is an ordinary `NameError`:

    class Cart(Definition):
        parameters = Settings(top_speed=velocity("m/s", default=1.0))
        command = In(lambda p: Schema("cart.command", {...: p.top_speed}))
        state = Out(Schema("cart.state", {...}))

On the class, `Cart.state` is the port; on an instance, `cart.state` is its live
DefDict, and `cart.state = {"x": 1.0}` updates it by the rules of the schema.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any, Self, cast, overload
from weakref import WeakKeyDictionary

from rems_net.agents.runtime import RUNTIME, Runtime
from rems_net.defdict import Batch, DefDict, Field, Schema, merge_schemas
from rems_net.errors import FieldValueError, SchemaError, UnknownAttributeError

#: Number of schemas kept per port that depend on parameters.
KEPT = 100


def _mark(own: dict[str, Any], name: str) -> None:
    """Note that the agent has set this Out."""
    run: Runtime = own[RUNTIME]
    run.touched = run.written[name] = True


class Slot:
    """A class attribute whose value on an instance is a live DefDict."""

    name = ""
    owner = "?"
    _home: type = object
    #: whether a read counts as setting it
    marks = False

    def __set_name__(self, owner: type, name: str) -> None:
        self.name, self.owner, self._home = name, owner.__name__, owner

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> DefDict: ...
    def __get__(self, instance: object | None, owner: type) -> Self | DefDict:
        if instance is None:
            return self.of(owner)
        own = instance.__dict__
        if self.marks:
            _mark(own, self.name)
        try:
            live: DefDict = own[self.name]
        except KeyError:
            raise AttributeError(
                f"{type(instance).__name__}.{self.name} has no value yet; settings get "
                "theirs in __init__, ports in prepare(). (R0507)"
            ) from None
        return live

    def of(self, owner: type) -> Self:
        """Return this slot as a class has it."""
        return self

    def __set__(self, instance: object, values: Mapping[str, Any]) -> None:
        own = instance.__dict__
        if type(values) is not dict and not isinstance(values, Mapping | DefDict):
            live: DefDict = own[self.name]
            raise FieldValueError(
                f"{type(instance).__name__}.{self.name} is set to {values!r}; expected "
                f"a dict of its fields, which are {', '.join(live.schema.paths)}."
                " (R0507)"
            )
        if self.marks:
            _mark(own, self.name)
        own[self.name].update(values)


class Port(Slot):
    """A value with a schema, at the agent's key `<kind>/<name>/<port>`.

    `schema` is a Schema, another port (to take its schema), a function of the agent's
    parameters (for a range that depends on them), or None: then an In takes the schema
    of the port that it reads. If this agent lacks the parameters of another port's
    schema, the defaults of that port's own class are used.

    Raises SchemaError for anything else.
    """

    def __init__(
        self, schema: "Schema | Port | Callable[[DefDict], Schema] | None" = None
    ):
        given = schema._schema if isinstance(schema, Port) else schema
        if isinstance(given, type) or not (given is None or callable(given)):
            kind, fields = type(self).__name__, "{'left': velocity()}"
            shown = "{...}" if isinstance(given, dict) else f"{given!r:.60}"
            raise SchemaError(
                f"{kind}({shown}) is no schema; write such as "
                f"{kind}(Schema('speeds', {fields})). (R0509)"
            )
        #: the port from which it takes its schema
        self._like = schema if isinstance(schema, Port) else None
        self._schema: Schema | Callable[[DefDict], Schema] | None = given
        #: results of the function, by parameters: a crowd has one schema
        self._made: dict[tuple[type, bytes], Schema] = {}
        #: this port as subclasses have it, by class
        self._inherited: WeakKeyDictionary[type, Port] = WeakKeyDictionary()

    @property
    def is_open(self) -> bool:
        """Whether it has no schema of its own."""
        return self._schema is None

    def of(self, owner: type) -> Self:
        """Return this port with the defaults of `owner`, which may inherit it.

        The range of `Create2.command` depends on Create2's own parameters.
        """
        if owner is self._home or not callable(self._schema):
            return self
        if owner not in self._inherited:
            port = copy(self)
            port._home, port._made = owner, {}
            self._inherited[owner] = port
        return cast("Self", self._inherited[owner])

    def schema_for(self, parameters: DefDict) -> Schema | None:
        """Return the schema of this port on an agent with these parameters."""
        if self._schema is None or isinstance(self._schema, Schema):
            return self._schema
        key = type(parameters), parameters.encode()
        if key not in self._made:
            if len(self._made) >= KEPT:
                self._made.clear()
            self._made[key] = self._depending(self._schema, parameters)
        return self._made[key]

    def _depending(
        self, schema: Callable[[DefDict], Schema], parameters: DefDict
    ) -> Schema:
        like = self._like
        own = getattr(like and like._home, "parameters", None)
        try:
            return schema(parameters)
        except UnknownAttributeError:
            if like is None or not isinstance(own, Settings):
                raise
        try:
            return schema(own.schema())
        except UnknownAttributeError:
            kind, robot = type(self).__name__, like._home.__name__
            raise SchemaError(
                f"{self.owner}.{self.name} takes the schema of {robot}.{like.name}, "
                f"which depends on parameters that {robot} does not have. Name a robot "
                f"that has them, such as {kind}(Woodbot.{like.name}). (R0509)"
            ) from None

    @property
    def schema(self) -> Schema:
        """The schema, if it does not depend on the agent's parameters."""
        if isinstance(self._schema, Schema):
            return self._schema
        raise SchemaError(
            f"The schema of {self.owner}.{self.name} is known only on an instance: "
            "it depends on parameters or on a connection. (R0507)"
        )


class Out(Port):
    """A port that this agent writes."""

    # `self.value["x"] = 1` reads the slot, and changes the value that it returns.
    marks = True


class In(Port):
    """A port that this agent reads: connected to an Out, or set from outside.

    `source` is the default connection: an agent ("input/keys"), a port
    ("robot/sim/state") or, for an In without a schema, a glob ("robot/*/state"); then
    the value is a plain dict, port key to DefDict, in the order of the keys. An agent
    that is connected to itself reads its own value of the step before; a glob leaves
    the agent itself out.

    messages: for an output that records: its value is `Messages`, each port's message
    in CDR as it came, without a DefDict between. It has no schema, and a glob.
    optional: whether an experiment may leave it out; then it is not in
    `runtime(self).sources`, from `prepare()` on
    """

    def __init__(
        self,
        schema: Schema | Port | Callable[[DefDict], Schema] | None = None,
        *,
        source: str | None = None,
        messages: bool = False,
        optional: bool = False,
    ):
        super().__init__(schema)
        self.source, self.messages, self.optional = source, messages, optional


class Messages(Batch):
    """Messages in CDR by port key, of the ports that have written since it was cleared.

    schemas: of every port that is read, by port key.
    agents: the badge of its host, by key of each agent that is read now.
    callers: the ports by which processes call verbs.
    called: calls from outside: the key of the agent, a sentence, and the badge of the
        process that sent it; None for this one.
    """

    def __init__(self) -> None:
        super().__init__()
        self.schemas: dict[str, Schema] = {}
        self.agents: dict[str, int] = {}
        self.callers: list[str] = []
        self.called: list[tuple[str, str, int | None]] = []


def merge_slots(parts: Sequence[tuple[Slot, str]], name: str) -> Slot:
    """Return one slot with the fields of all these; each has its class's name.

    Raises SchemaError for a field that two define differently: at once, or, for a
    schema that depends on parameters, when they are known.
    """
    settings = [(s, origin) for s, origin in parts if isinstance(s, Settings)]
    if settings:
        return Settings(
            merge_schemas(((s.schema, o) for s, o in settings), name).entries
        )
    ports = [(s, origin) for s, origin in parts if isinstance(s, Port)]

    def merged(parameters: DefDict) -> Schema:
        each = [(port.schema_for(parameters), origin) for port, origin in ports]
        return merge_schemas(((s, o) for s, o in each if s is not None), name)

    kind = In if isinstance(ports[0][0], In) else Out
    static = [(p._schema, o) for p, o in ports if isinstance(p._schema, Schema)]
    if len(static) == len(ports):
        return kind(merge_schemas(static, name))
    return kind(merged)


class Settings(Slot):
    """Settings of an agent before it starts: parameters or options.

    Takes fields by name; the values are checked like any others, units included.
    """

    def __init__(
        self,
        fields: Mapping[str, Field | Schema] | None = None,
        /,
        **more: Field | Schema,
    ):
        self.fields: dict[str, Field | Schema] = {**(fields or {}), **more}

    @cached_property
    def schema(self) -> Schema:
        return Schema(f"{self.owner}.{self.name}", self.fields)
