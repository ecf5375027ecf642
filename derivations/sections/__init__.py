"""The sections of the paper as equations, one module a section and topic; importing it reads all."""

from derivations.sections import (  # noqa: F401
    section2_systems,
    section3_results,
    section4_reduction,
    section7_critical,
    section7_friction,
    section8_release,
)
from derivations.sections.section5 import escape, positive, stationary  # noqa: F401
from derivations.sections.section6 import (  # noqa: F401
    crossing,
    expansions,
    pair,
    series,
    sliding,
    stokes,
    uniform,
    well,
)
