"""T and 1 - P through the coalescence of wells, barriers, starts and ends."""
