"""Offers: what each machine of an experiment shall bring, and what it is given."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.experiment.placement.needs import carried, code_of, data_of
from rems_net.agents.protocol.alike import laptop
from rems_net.agents.protocol.limits import FILE_BYTES, SENT
from rems_net.agents.protocol.placement import File, Offer
from rems_net.agents.protocol.plan import Plan
from rems_net.errors import ExperimentError


@dataclass(frozen=True, slots=True)
class Offers:
    """What the machines of an experiment are given, and what it is read from.

    hosts: all plans, by host.  machines: by host, the machine that shall bring it.
    """

    name: str
    folder: Path
    hosts: Mapping[str, Sequence[Plan]]
    machines: Mapping[str, str]
    agents: Mapping[str, Agent]

    def make(self) -> tuple[dict[str, Offer], dict[str, bytes]]:
        """By machine, what it shall bring; by digest, the files that travel.

        Raises ExperimentError for what can't be had elsewhere.
        """
        offers: dict[str, Offer] = {}
        files: dict[str, bytes] = {}
        for machine in sorted(set(self.machines.values())):
            hosts = [h for h, where in self.machines.items() if where == machine]
            plans = [plan for host in hosts for plan in self.hosts[host]]
            offers[machine], data = self._offer(machine, plans)
            files |= data
        return offers, files

    def _offer(
        self, machine: str, plans: Sequence[Plan]
    ) -> tuple[Offer, dict[str, bytes]]:
        hosts: dict[str, list[dict[str, Any]]] = {}
        code: dict[str, str] = {}
        paths: dict[str, Path] = {}
        for plan in plans:
            with origin(f"{plan.kind} {plan.name!r}"):
                agent, classes = self.agents[plan.key], []
                for cls in plan.classes:
                    reference, file = carried(cls, self.folder)
                    classes.append(reference)
                    if file is not None:
                        code |= code_of(file, self.folder)
                paths |= data_of(agent, self.folder)
                plain = plan.to_wire(agent) | {"classes": classes}
                for own in ("folder", "out"):  # each machine has its own
                    del plain[own]
                hosts.setdefault(plan.host, []).append(plain)
        data = {name: path.read_bytes() for name, path in paths.items()}
        size = sum(map(len, data.values()))
        if len(data) > SENT or size > FILE_BYTES:
            raise ExperimentError(
                f"machine {machine} would be sent {len(data)} files of {size} bytes; "
                f"expected at most {SENT}, of {FILE_BYTES} bytes together. Copy them "
                "there, and use `rems bring FILE --only`."
            )
        digests = {name: hashlib.sha256(d).hexdigest() for name, d in data.items()}
        offer = Offer(
            self.name,
            laptop(),
            hosts,
            sys.argv[1:] if code else [],
            {name: File(len(d), digests[name]) for name, d in data.items()},
            code,
        )
        return offer, {digests[name]: d for name, d in data.items()}


def machines_of(
    by_host: Mapping[str, Sequence[Plan]], without: Collection[str]
) -> dict[str, str]:
    """By host, the machine that shall bring it, where that is not this one.

    without: hosts that somebody brings by hand. Raises ExperimentError for agents of
    one host on two machines.
    """
    found = {}
    for host, plans in by_host.items():
        machine = plans[0].machine
        for plan in plans:
            if plan.machine != machine:
                raise ExperimentError(
                    f"{plans[0].key} and {plan.key} share the process {host!r}, and "
                    f"are on {_where(machine)} and {_where(plan.machine)}; give both "
                    "the same machine, or a host each."
                )
        if machine and host not in without:
            found[host] = machine
    return found


def _where(machine: str) -> str:
    return f"machine {machine}" if machine else "this one"
