// navigator.serial with one port, as browsers have it (wicg.github.io/serial): a stream
// that has failed is replaced by a new one; after the cable was pulled there is none.
// Its other end is the test: it calls `cable`, and is called by `toTest`.
"use strict";

const cable = { stream: null, controller: null, there: true, opened: false };

cable.open = () => {
  cable.stream = new ReadableStream({
    start: (controller) => { cable.controller = controller; },
    cancel: () => { cable.stream = null; },
  });
};
cable.receive = (bytes) => {
  if (cable.stream === null) cable.open();
  cable.controller.enqueue(new Uint8Array(bytes));
};
cable.fail = (name) => {
  if (cable.stream === null) cable.open();
  cable.controller.error(new DOMException(`a ${name} of the test`, name));
  cable.stream = null;
};
cable.pull = () => {
  cable.there = false;
  cable.fail("NetworkError");
};

const port = {
  async open({ baudRate }) {
    if (cable.opened) throw new DOMException("The port is open.", "InvalidStateError");
    if (!cable.there) throw new DOMException("It is gone.", "NetworkError");
    cable.opened = true;
    toTest(JSON.stringify({ open: baudRate }));
  },
  async close() {
    if (port.readable && port.readable.locked) throw new TypeError("It is locked.");
    cable.opened = false;
    cable.stream = cable.writing = null;
    toTest(JSON.stringify({ open: 0 }));
  },
  get readable() {
    if (!cable.opened || !cable.there) return null;
    if (cable.stream === null) cable.open();
    return cable.stream;
  },
  get writable() {
    if (!cable.opened || !cable.there) return null;
    cable.writing ??= new WritableStream({
      write: (bytes) => toTest(JSON.stringify({ bytes: [...bytes] })),
    });
    return cable.writing;
  },
  getInfo: () => ({}),
};

Object.defineProperty(navigator, "serial", {
  value: { requestPort: async () => port },
});
