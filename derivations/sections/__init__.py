"""The sections of the paper as equations, with a module for each section and topic.

A module is imported when one of its labels is used; `MODULES` maps each label to its module.
"""

import re
from pathlib import Path

from symasym.derivation.derivation import MODULES

for path in sorted(Path(__file__).parent.rglob("*.py")):
    module = ".".join((__name__, *path.relative_to(Path(__file__).parent).with_suffix("").parts))
    labels = re.findall(r'^@derives\("([^"]+)"', path.read_text("utf-8"), re.MULTILINE)
    MODULES.update(dict.fromkeys(labels, module))
