"""``python -m symasym`` is the command ``symasym``."""

import sys

from symasym.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
