"""`python -m rems_net.firmware`: emulated Woodbots, for `rems board emulate`.

Its standard input has their settings; when that ends, the robots end.
"""

import sys

if not sys.flags.safe_path:
    del sys.path[0]

from rems_net.agents.host.lifeline import Lifeline, deaf_to_ctrl_c, end

if __name__ == "__main__":
    deaf_to_ctrl_c()
    lifeline = Lifeline()

    from rems_net.firmware.robot import main

    end(main(lifeline))
