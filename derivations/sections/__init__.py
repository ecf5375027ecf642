"""The sections of the paper as equations, one module a section and topic.

A module is imported when one of its labels is asked for: `MODULES` has where each is derived.
"""

import re
from pathlib import Path

from symasym.derivation.derivation import MODULES

for path in sorted(Path(__file__).parent.rglob("*.py")):
    module = ".".join((__name__, *path.relative_to(Path(__file__).parent).with_suffix("").parts))
    labels = re.findall(r'^@derives\("([^"]+)"', path.read_text("utf-8"), re.MULTILINE)
    MODULES.update(dict.fromkeys(labels, module))
