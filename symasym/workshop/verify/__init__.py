"""Every formula and every evaluator against quadrature, balls and identities.

The layers, each importing only those before it: `findings` (what a check says, scenes and what they
are compared with); `exact_checks`, `claims`, `orders`, `formulas` (the checks themselves); `run`
(which of them at which level, in processes; the table and the JSON record).
"""

from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.run import Verification, verify

__all__ = ["Finding", "Verification", "verify"]
