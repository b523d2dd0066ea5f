"""`python -m rems_net.agents.host`: the program of a host process.

The order of its first lines matters. Ctrl+C and the parent's end are handled before
anything else is imported: its parent can die while a host still starts, and a
terminal's Ctrl+C can reach it.
"""

import gc
import sys

# `-m` has put the working folder first. A random.py there must not be imported here;
# agents import by the path that their parent sends.
if not sys.flags.safe_path:
    del sys.path[0]

from rems_net.agents.host.lifeline import Lifeline, deaf_to_ctrl_c, end

if __name__ == "__main__":
    deaf_to_ctrl_c()
    lifeline = Lifeline()

    gc.disable()  # imports leave no garbage: a search takes a tenth of their time
    from rems_net.agents.host.main import main

    gc.enable()
    end(main(lifeline))
