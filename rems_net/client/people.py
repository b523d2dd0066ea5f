"""People of the class: users, their laptops, and what they run there."""

from rems_net.client.answers import NONSENSE
from rems_net.errors import FabricError, WireError
from rems_net.router.gate.access import WHO
from rems_net.router.mail import Mail
from rems_net.router.message import read
from rems_net.router.relay.people import Person
from rems_net.router.session import Session


def people(session: Session) -> list[Person]:
    """Return the people that this user may see: for a student, the own team.

    Raises FabricError for a router without users, and for one that does not answer.
    """
    at, user = session.link.endpoint, session.link.user
    if not user:
        raise FabricError(
            f"The router at {at} has no list of names. Type where it runs: "
            "rems router serve --class names.csv (R0617)"
        )
    for mail in session.ask(f"{WHO}/{user}?people", first=True):
        try:
            return _read(mail)
        except NONSENSE:
            break
    raise FabricError(
        f"The router at {at} does not list people. It needs this version of "
        "rems_net; type where it runs: rems router serve (R0617)"
    )


def _read(mail: Mail) -> list[Person]:
    found = [Person(*row) for row in read(mail.payload)]
    for one in found:
        texts = one.user, one.team, one.laptop, one.since, *one.runs
        if not (type(one.here) is bool and all(text.isprintable() for text in texts)):
            raise WireError("it is nobody (R0621)")
    return found
