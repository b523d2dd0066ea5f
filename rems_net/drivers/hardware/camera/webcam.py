"""Webcam: driver of a camera at this computer, by OpenCV."""

from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net.agents.ports import Settings
from rems_net.agents.runtime import runtime
from rems_net.defdict import DefDict, frequency, integer, text, time
from rems_net.drivers.hardware.device_thread import Readings
from rems_net.drivers.hardware.driven import Driven
from rems_net.drivers.needs import missing
from rems_net.eyes.opencv import Webcam as Device
from rems_net.libraries import look_for

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Webcam(Driven):
    """Driver of a camera at this computer.

    A picture has the tick at which it came, less the option `delay`: some webcams need
    a fifth of a second. Pictures that are the same bytes as the last count as none, so
    a frozen webcam's picture grows old. So does the last picture of a film, which can
    take the place of a webcam: one picture in each exchange.
    """

    needs = ("cv2",)
    options = Settings(
        number=integer(range=(0, 100), doc="of the webcams of this computer"),
        film=text(doc="file in its place, or pictures such as shot-%03d.png"),
        rate=frequency("Hz", range=(0, 10_000), doc="pictures; 0: 30 a second"),
        delay=time(range=(0, 1), doc="from what a picture shows to when it comes"),
    )
    rate = 30.0
    checks = (
        "Check, in this order: 1. that it is plugged in; 2. that no other program uses "
        "it, such as a video call; 3. its number, as in options = { number = 1 }."
    )
    _open: Device | None = None
    _last: "NDArray[np.uint8] | tuple[()]" = ()

    def prepare(self) -> None:
        """Check that OpenCV is here, and that the definition is a camera."""
        look_for("cv2", "camera")
        if not hasattr(self, "still"):
            raise missing(
                self, "still()", "its lens and its place", 'definition = "camera"'
            )
        super().prepare()

    def connect(self) -> None:
        """Open the webcam. Raises OSError if it is not there, or of another size."""
        p, film = self.parameters, self.options["film"]
        source = str(self.folder / film) if film else self.options["number"]
        self._open = Device(source, p["width"], p["height"])
        self._last = ()

    def exchange(self, command: DefDict) -> Readings | None:
        """Return the newest picture. Raises TimeoutError if none comes."""
        assert self._open is not None
        film = self.options["film"]
        if film and not self.tick.n and len(self._last):
            return None  # the second picture comes with the first tick
        picture = self._open.read()
        if picture is None and not film:
            raise TimeoutError("the webcam gives no picture")
        if picture is None or np.array_equal(picture, self._last):
            return None
        self._last = picture
        still: dict[str, Any] = self.still()  # type: ignore[attr-defined]
        n, late = self.tick.n, self.options["delay"] * (self.tick.pace or 1.0)
        shot = max(0, n - round(late / runtime(self).dt)) if n else 0
        return {"sensors": {**still, "picture": picture, "tick": shot}}

    def is_still(self) -> bool:
        return True  # it has no motor

    def disconnect(self) -> None:
        """Give the webcam back."""
        if self._open is not None:
            self._open.close()
        self._open = None

    def explain(self, error: OSError) -> str:
        """Return the sentence of an error: it is OpenCV's, or our own."""
        return str(error)
