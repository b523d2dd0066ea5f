"""Improv's own client from npm in Chromium, at a robot's own firmware."""

import threading
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from tests.firmware.console.chromium.browser import Page
from tests.firmware.console.chromium.uart import received

PAGE = """<!DOCTYPE html><script type="module">
import { ImprovSerial } from "./serial.js";
globalThis.provision = async () => {
  const port = await navigator.serial.requestPort();
  await port.open({ baudRate: 115200 });
  const improv = new ImprovSerial(port, { log() {}, debug() {}, error() {} });
  const info = await improv.initialize(20000);
  const networks = await improv.scan();
  const refused = await improv.provision("lab-net", "wrong horse").catch(String);
  await improv.provision("lab-net", "correct horse");
  await improv.close();
  return { name: info.name, networks: networks.length, refused, state: improv.state };
};
</script>"""
START = """provision().then((done) => { globalThis.done = done },
                            (error) => { globalThis.done = String(error) }); null"""


class Quiet(SimpleHTTPRequestHandler):
    """A server of files that prints nothing."""

    def log_message(self, *words: Any) -> None:
        """Print nothing."""


def test_it_sets_the_network_through_noise(
    show: Callable[[str], Page], client: Path
) -> None:
    """The line begins with text that was sent at another speed."""
    (client.parent / "page.html").write_text(PAGE)
    with ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Quiet, directory=str(client.parent))
    ) as server:
        threading.Thread(target=server.serve_forever).start()
        try:
            page = show(f"http://127.0.0.1:{server.server_port}/page.html")
            page.until("globalThis.provision !== undefined")
            page.tab.run(START)
            page.until("cable.opened")
            wrong = received(b"rst:0x1 (POWERON_RESET)\r\n" * 20, 74_880, 115_200)
            noise = [one for one in wrong if isinstance(one, int)]
            assert len(noise) > 100
            page.tab.run(f"cable.receive({[*noise, 10]})")
            done = page.until("globalThis.done")
        finally:
            server.shutdown()
    assert done == {
        "name": "woodbot",
        "networks": 4,
        "refused": "UNABLE_TO_CONNECT",
        "state": 4,
    }
    assert b"ssid=lab-net\n" in page.robot.settings.read_bytes()
