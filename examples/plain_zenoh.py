"""No rems_net: any program that has Zenoh and msgpack reads states, and drives.

Start `rems run open.toml` first.
"""

import msgpack
import zenoh

config = '{mode: "client", connect: {endpoints: ["tcp/127.0.0.1:7447"]}}'
with zenoh.open(zenoh.Config.from_json5(config)) as session:
    for sample in session.declare_subscriber("rems/robot/*/state"):
        print(sample.key_expr, msgpack.unpackb(sample.payload.to_bytes()))
        command = {"wheel": {"left": 3.0, "right": 2.0}}  # rad/s
        session.put("rems/robot/sim/command", msgpack.packb(command))
