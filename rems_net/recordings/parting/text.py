"""Printed text about where and why robots part; 80 columns wide."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from math import degrees
from textwrap import wrap

from rems_net.recordings.parting.parting import FEW, Cause, Parting
from rems_net.recordings.parting.sentences import length, side

WIDE = 80
#: explanations that are shown, each with its share
SHOWN = 6
#: any unit. A smaller difference is none.
SAME = 1e-9
#: fraction of the difference that a shown explanation accounts for, at least
LEAST = 0.05


def line(one: Parting) -> str:
    """Return a sentence: the share explained, and the explanation."""
    if one.where is None:
        return _alike(one) + f" ({_rms(one)})" * (one.rows >= FEW and one.rms >= SAME)
    about = f"{_short(one.field)} " * bool(one.field)
    if not one.causes:
        best = one.tried[0]
        return (
            f"{about}nothing tried explains half; {_share(best).strip()}: {_all(best)}"
        )
    parts = _by_share(one.causes)
    words = [_and([c.says for c in some]) for some, _ in parts]
    shares = [f" ({100 * share:.0f} %)" for _, share in parts[:-1]] + [""]
    what = "; ".join(w + s for w, s in zip(words, shares, strict=True))
    return f"{_share(one.causes)}  {about}{what}"


def detail(one: Parting) -> Iterator[str]:
    """Yield lines: where and why, and what else was tried."""
    there, unit = one.where, f" {one.unit}" * bool(one.unit)
    title = f"{one.a} - {one.b}" + (f", {_short(one.field)}" if one.field else "")
    if there is None:
        yield f"{title}: {_alike(one)} ({_rms(one)})"
        return
    yield title
    pose = not one.field

    def size(number: float) -> str:
        if there is not None and there.heading:
            return f"{degrees(number):.3g} deg"
        return length(number) if pose else f"{number:.3g}{unit}"

    yield from _item(
        "when",
        f"more than {size(there.limit)} apart from {there.time:.2f} s on; "
        f"{'grows' if there.rate > 0 else 'shrinks'} by {size(abs(there.rate))}/s in "
        f"the second after that; at most {size(there.most)}, at {there.latest:.2f} s",
    )
    if pose:
        x, y, heading = there.place
        where = f"at x {x:.3f} m, y {y:.3f} m, heading {degrees(heading):.0f} deg"
        yield from _item("then", f"{one.b} is {where}: {side(*there.off)}")
    else:
        yield from _item("then", f"{one.b} is at {there.place[0]:.4g}{unit}")
    if there.command:
        told = [f"{n} {v:.3g} {u}".rstrip() for n, (v, u) in there.command.items()]
        more = ", ..." if len(told) > SHOWN else ""
        yield from _item("told", ", ".join(told[:SHOWN]) + more)
    if there.near:
        yield from _item("near", f"{one.b}: {', '.join(there.near)}")
    if one.through:
        parts = sorted(one.through.items(), key=lambda part: -part[1])
        words = [f"{name} {100 * max(0.0, share):.0f} %" for name, share in parts]
        yield from _item("through", f"{', '.join(words)}; each alone")
    yield from _item("why", line(one))
    for cause in one.causes:
        yield from _item("look at", cause.look)
    helped = [some for some in one.tried if some[0].share > LEAST]
    for k, some in enumerate(helped[:SHOWN]):
        yield from _item("tried" * (k == 0), f"{_share(some)}  {_all(some)}", 7)


def _item(name: str, text: str, indent: int = 0) -> Iterator[str]:
    for k, part in enumerate(wrap(text, WIDE - 10, subsequent_indent=" " * indent)):
        yield f"  {name if k == 0 else '':<8}{part}"


def _short(field: str) -> str:
    return field.removeprefix("state/")


def _alike(one: Parting) -> str:
    few = f"{one.rows} rows are too few to find why"
    same = "the same" if one.rms < SAME else "they agree"
    return few if one.rms and one.rows < FEW else same


def _rms(one: Parting) -> str:
    return f"rms {one.rms:.2g} {one.unit}".rstrip()


def _share(causes: Sequence[Cause]) -> str:
    return f"{100 * max(0.0, causes[-1].share):3.0f} %"


def _all(causes: Sequence[Cause]) -> str:
    return _and([cause.says for cause in causes])


def _and(words: Sequence[str]) -> str:
    return ", and ".join(words)


def _by_share(causes: Sequence[Cause]) -> list[tuple[list[Cause], float]]:
    groups = groupby(causes, key=lambda cause: cause.share)
    return [([*some], share) for share, some in groups]
