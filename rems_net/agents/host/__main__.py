"""`python -m rems_net.agents.host`: what a host process runs.

The order of its first lines matters. Ctrl+C and the parent's end are seen to before
anything else is imported: a host that still starts can be left alone by its parent,
and a terminal's Ctrl+C can reach it.
"""

from __future__ import annotations

from rems_net.agents.host.lifeline import Lifeline, deaf_to_ctrl_c, end

if __name__ == "__main__":
    deaf_to_ctrl_c()
    lifeline = Lifeline()

    from rems_net.agents.host.main import main

    end(main(lifeline))
