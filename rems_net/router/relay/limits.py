"""Limits: the part of a router that one address, or one user, may use."""

import ipaddress
from collections import OrderedDict
from collections.abc import Callable
from typing import Generic, TypeVar

#: s. A client that is not let in by then is disconnected; over bad Wi-Fi a handshake
#: takes about 1 s.
HANDSHAKE_TIMEOUT = 5.0
#: Connections that are not let in yet, of one address and of all other machines: a
#: class of thirty behind one address joins within a second. Zenoh itself accepts 500.
OF_ONE, OF_ALL = 64, 256
#: Connections that are not let in yet, of the router's own machine.
OF_OURS = 64
#: Connections of one address in a second: thirty laptops behind one address may try
#: again five times each.
A_SECOND = 256
#: Sessions of one user: a laptop with a run of thirty robots has some forty.
OF_USER = 64
#: Sessions of one address at a router without users: a class may share an address.
OF_ADDRESS = 256
#: Wrong passwords of one address in a second.
GUESSES = 3
#: Addresses whose wrong passwords are counted at a time.
ADDRESSES = 4096

T = TypeVar("T")


def group(host: str) -> str:
    """Return the group of an address: an IPv6 host can use 2^64 addresses."""
    address = ipaddress.ip_address(host.partition("%")[0])
    if isinstance(address, ipaddress.IPv6Address):
        if address.ipv4_mapped:
            return str(address.ipv4_mapped)
        if not address.is_loopback:
            return str(ipaddress.ip_network((address, 64), strict=False))
    return str(address)


class Waiting(Generic[T]):
    """The connections that are not let in yet, by address, the oldest first."""

    def __init__(self, of_one: int, of_all: int):
        self._of_one, self._of_all = of_one, of_all
        self._by_group: dict[str, OrderedDict[T, float]] = {}
        self.count = 0

    def add(self, who: str, one: T, now: float) -> T | None:
        """Add a connection. Return one that must be closed for it, or None.

        That is the oldest of its own address if this has too many, else the oldest of
        the address with the most connections.
        """
        own = self._by_group.setdefault(who, OrderedDict())
        own[one] = now
        self.count += 1
        if len(own) > self._of_one:
            return next(iter(own))
        return self.oldest() if self.count > self._of_all else None

    def oldest(self) -> T | None:
        """Return the oldest of the address with most; None if none waits."""
        fullest = max(self._by_group.values(), key=len, default=None)
        return next(iter(fullest)) if fullest else None

    def remove(self, who: str, one: T) -> None:
        """Forget a connection that is let in or gone; ignore an unknown one."""
        own = self._by_group.get(who, OrderedDict())
        if own.pop(one, None) is not None:
            self.count -= 1
            if not own:
                del self._by_group[who]

    def older(self, than: float) -> list[T]:
        """Return the connections that came before this time."""
        found = []
        for own in self._by_group.values():
            for one, came in own.items():
                if came > than:
                    break
                found.append(one)
        return found


class Guesses:
    """Wrong passwords by address: GUESSES at once, and as many more a second."""

    def __init__(self, clock: Callable[[], float]):
        self._clock = clock
        #: by address: the count, and its time
        self._counts: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def may(self, who: str) -> bool:
        """Return whether this address may try a password now."""
        return self._count(who) <= GUESSES - 1

    def add(self, who: str) -> None:
        """Count a wrong password."""
        self._counts[who] = (self._count(who) + 1, self._clock())
        self._counts.move_to_end(who)
        if len(self._counts) > ADDRESSES:
            self._counts.popitem(last=False)

    def _count(self, who: str) -> float:
        count, then = self._counts.get(who, (0.0, 0.0))
        return max(0.0, count - (self._clock() - then) * GUESSES)
