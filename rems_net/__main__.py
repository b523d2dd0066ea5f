"""`python -m rems_net` is `rems`, if the command is not on the path."""

import sys

# `-m` has put the working folder first, where a user's random.py would hide another.
if not sys.flags.safe_path:
    sys.path.append(sys.path.pop(0))

from rems_net.cli import main

if __name__ == "__main__":
    sys.exit(main())
