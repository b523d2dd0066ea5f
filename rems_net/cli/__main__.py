"""`python -m rems_net.cli` is `rems`, where the command is not on the path."""

import sys

from rems_net.cli import main

if __name__ == "__main__":
    sys.exit(main())
