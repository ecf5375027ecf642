"""For the time of the move."""
from derivations.chapters import section2_systems, section3_results, section4_reduction, section7_critical, section7_friction, section8_release
from derivations.chapters.section5 import escape, positive, stationary
from derivations.chapters.section6 import crossing, expansions, pair, series, sliding, stokes, uniform, well
