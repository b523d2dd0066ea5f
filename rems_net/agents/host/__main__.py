"""`python -m rems_net.agents.host`: what a host process runs.

The order of its first lines matters. Ctrl+C and the parent's end are seen to before
anything else is imported: a host that still starts can be left alone by its parent,
and a terminal's Ctrl+C can reach it.
"""

from __future__ import annotations

import gc
import sys

# `-m` has put the working folder first. A random.py that a user has there is his; what
# agents import comes by the path that their parent tells.
if not sys.flags.safe_path:
    del sys.path[0]

from rems_net.agents.host.lifeline import Lifeline, deaf_to_ctrl_c, end

if __name__ == "__main__":
    deaf_to_ctrl_c()
    lifeline = Lifeline()

    gc.disable()  # imports leave no garbage; to look for it takes a tenth of their time
    from rems_net.agents.host.main import main

    gc.enable()
    end(main(lifeline))
