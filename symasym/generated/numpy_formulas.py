"""The formulas of `mpmath_formulas` in float64, for arrays that broadcast together.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

from functools import partial
from types import SimpleNamespace

import numpy as np

from symasym.generated import mpmath_formulas as formulas
from symasym.generated import plain_formulas as plain

# What the formulas ask of their context.
_ARCS = {f"a{name}": getattr(np, f"arc{name}") for name in ("sin", "cos", "tan")}
_FLOATS = SimpleNamespace(**{**vars(np), **_ARCS, "mpf": float})

scaled_noise = partial(formulas.scaled_noise, _FLOATS)
scaled_radius = plain.scaled_radius
potential_left = partial(formulas.potential_left, _FLOATS)
potential_right = partial(formulas.potential_right, _FLOATS)
escape_time_of_halves = plain.escape_time_of_halves
exit_share = plain.exit_share
log_exit_share = partial(formulas.log_exit_share, _FLOATS)
density_of_halves = plain.density_of_halves
occupation_share = plain.occupation_share
log_occupation_share = partial(formulas.log_occupation_share, _FLOATS)
tail_left = plain.tail_left
tail_right = plain.tail_right
constant_single = partial(formulas.constant_single, _FLOATS)
constant_nested_down = partial(formulas.constant_nested_down, _FLOATS)
constant_nested_up = partial(formulas.constant_nested_up, _FLOATS)
carried = plain.carried
absorbed = plain.absorbed
constant_drift_time = partial(formulas.constant_drift_time, _FLOATS)
constant_drift_exit = partial(formulas.constant_drift_exit, _FLOATS)
exit_bound = partial(formulas.exit_bound, _FLOATS)
outer_piece = partial(formulas.outer_piece, _FLOATS)
strong_noise_time = partial(formulas.strong_noise_time, _FLOATS)
strong_noise_time_next = partial(formulas.strong_noise_time_next, _FLOATS)
well_term = partial(formulas.well_term, _FLOATS)
log_well_term = partial(formulas.log_well_term, _FLOATS)
saddle_correction = partial(formulas.saddle_correction, _FLOATS)
saddle_first = plain.saddle_first
saddle_second = plain.saddle_second
manifold_term = plain.manifold_term
endpoint_shares = plain.endpoint_shares
kink_change = plain.kink_change
fall_by_powers = plain.fall_by_powers
finite_part = plain.finite_part
bend_of_saddle = plain.bend_of_saddle
first_moment = partial(formulas.first_moment, _FLOATS)
next_moment = plain.next_moment
time_of_doubles = plain.time_of_doubles
on_the_right = plain.on_the_right
share_of_side = plain.share_of_side
pair_norm = partial(formulas.pair_norm, _FLOATS)
canonical = partial(formulas.canonical, _FLOATS)
pair_share = partial(formulas.pair_share, _FLOATS)
over_pair = partial(formulas.over_pair, _FLOATS)
over_pair_twice = partial(formulas.over_pair_twice, _FLOATS)
next_weight = plain.next_weight
pair_factors = plain.pair_factors
pair_units = partial(formulas.pair_units, _FLOATS)
end_distance = partial(formulas.end_distance, _FLOATS)
end_peak = partial(formulas.end_peak, _FLOATS)
end_mean = partial(formulas.end_mean, _FLOATS)
end_rest = partial(formulas.end_rest, _FLOATS)
over_end = partial(formulas.over_end, _FLOATS)
barrier_truncated = plain.barrier_truncated
well_truncated = plain.well_truncated
weak_noise_time = partial(formulas.weak_noise_time, _FLOATS)
well_edge = partial(formulas.well_edge, _FLOATS)
behind_barrier_term = partial(formulas.behind_barrier_term, _FLOATS)
occupation_from_layer = partial(formulas.occupation_from_layer, _FLOATS)
occupation_bound = partial(formulas.occupation_bound, _FLOATS)
strong_noise_occupation = partial(formulas.strong_noise_occupation, _FLOATS)
weak_noise_outside = partial(formulas.weak_noise_outside, _FLOATS)
friction_left = partial(formulas.friction_left, _FLOATS)
friction_coefficients = plain.friction_coefficients
friction_inside = partial(formulas.friction_inside, _FLOATS)
friction_right = partial(formulas.friction_right, _FLOATS)
friction_slope = partial(formulas.friction_slope, _FLOATS)
friction_potential_left = partial(formulas.friction_potential_left, _FLOATS)
friction_potential_inside = partial(formulas.friction_potential_inside, _FLOATS)
friction_potential_right = partial(formulas.friction_potential_right, _FLOATS)
friction_turning_point = partial(formulas.friction_turning_point, _FLOATS)
friction_breakaway = partial(formulas.friction_breakaway, _FLOATS)
friction_folds = partial(formulas.friction_folds, _FLOATS)
friction_angle = partial(formulas.friction_angle, _FLOATS)
friction_slope_well = partial(formulas.friction_slope_well, _FLOATS)
friction_slope_barrier = partial(formulas.friction_slope_barrier, _FLOATS)
friction_barrier = partial(formulas.friction_barrier, _FLOATS)
noise_threshold = partial(formulas.noise_threshold, _FLOATS)
