"""Every formula and every evaluator against quadrature, balls and identities.

The layers, each importing only those before it: `findings` (what a check says),
`random_scenes`, `references`, `field`; `exact_checks`, `claims`, `identities`, `orders`,
`limits`, `formulas` (the checks themselves); `tasks` (what is run at which level);
`run` (processes, interrupts); `pages` (the table and the JSON record).
"""

from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.run import Verification, verify

__all__ = ["Finding", "Verification", "verify"]
