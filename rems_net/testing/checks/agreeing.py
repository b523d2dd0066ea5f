"""Agreeing: whether it moves as its own mathematics does, in slow motion."""

from rems_net.testing import lines
from rems_net.testing.agreement import Agreement, measure
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject


def agrees(subject: Subject, outcome: Outcome) -> None:
    """Drive it and its model slowly, side by side."""
    found, why = measure(subject)
    if found is None:
        outcome.skipped = why
        return
    outcome.remark = (
        f"within {found.error:.2%} of its model ({found.allowed:.0%} allowed)"
    )
    if found.error <= found.allowed:
        return
    robot = subject.make()
    methods = ("exchange", "drive") if subject.driven else ("drive", "body")
    says = [name for name in ("derivative", "advance") if hasattr(robot, name)]
    outcome.wrong(
        expected=f"{found.field} within {found.allowed:.1%} of the "
        f"value by {lines.method(robot, *says)}, as {subject.definition.__name__}"
        ".tolerance allows, when it is driven slowly",
        came=f"commanded {found.command}, it is {found.is_at:.4g} {found.unit} after "
        f"{found.after:.2g} s, and the model {found.should:.4g} {found.unit}: "
        f"{found.error:.1%} of {found.scale:.3g} {found.unit}",
        where=lines.method(robot, *methods),
        type="look which is wrong: a sign, left and right, a radius for a diameter, "
        "degrees for radians" + _stated(found),
    )


def _stated(found: Agreement) -> str:
    """Return the line that sets a tolerance; "" if the error is too large for that."""
    above = next((x for x in (0.1, 0.15, 0.2, 0.3) if x > found.error), None)
    if above is None:
        return ""
    return (
        "; or, if it is meant so, put it in the definition:\n"
        f"    tolerance = {{{found.field!r}: {above:g}}}"
    )
