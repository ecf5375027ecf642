"""``python -m derivations``: the same as ``symasym derive``."""

from __future__ import annotations

import sys

from symasym.commands.main import main

if __name__ == "__main__":
    sys.exit(main(["derive", *sys.argv[1:]]))
