// A serial port as browsers have it, over a terminal's device.
import fs from "node:fs";
import tty from "node:tty";

export function openPort(path) {
  const fd = fs.openSync(path, fs.constants.O_RDWR | fs.constants.O_NOCTTY);
  const terminal = new tty.ReadStream(fd);
  terminal.setRawMode(true);
  const readable = new ReadableStream({
    start(controller) {
      terminal.on("data", (portion) => controller.enqueue(new Uint8Array(portion)));
      terminal.on("error", (error) => controller.error(error));
    },
    cancel() {
      terminal.destroy();
    },
  });
  const writable = new WritableStream({
    write: (portion) => new Promise((resolve) => terminal.write(portion, resolve)),
  });
  return { readable, writable };
}
