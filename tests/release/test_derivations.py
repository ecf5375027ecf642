"""What the chains behind `sa.release` conclude, measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symasym as sa


@pytest.mark.parametrize(("z", "flight"), [("-0.5", 0.01), ("-0.55", 0.04)])
def test_the_share_that_the_motion_of_z_takes_off(z, flight):
    """Marched with z in motion; the flight to r, which z leaves as it is, is no more than so."""
    z0, h, kappa = float(z), 1e-4, 0.15
    left, frozen, right = sa.escape_time(
        sa.friction(mu=3, alpha=1, z0=z0 + h * np.array([-1.0, 0.0, 1.0])), kappa, 10
    )
    slope = (right - left) / (2 * h)
    stated, eps = sa.formula("frozen-time").expression[0], 1e-3 / slope
    put = {"T_f": frozen, "T_f'": slope, "epsilon": eps, "g": -1.0}
    share = float(stated.subs({s: put[s.name] for s in stated.free_symbols})) / frozen - 1
    block = sa.oscillator(mu=3, alpha=1)
    whole = sa.release(block, kappa, 10, eps=eps, start=(0, z), method="march", rtol="1e-7")
    assert share == pytest.approx(whole.mean / frozen - 1, rel=flight)


def without_noise(eps: float, r: float, z: float) -> float:
    """Scaled time until u = r from (0, z), mu = 3 and alpha = 1."""

    def field(t: float, at: tuple[float, float]) -> tuple[float, float]:
        inside = min(max(at[0], -1.0), 1.0)
        force = 1 - at[1] - (inside + 3 * (inside - inside**3)) - eps * at[0]
        return force, eps * (eps * at[0] - 1)

    def at_end(t: float, at: tuple[float, float]) -> float:
        return at[0] - r

    at_end.terminal = True
    return solve_ivp(field, (0, 1e7), (0, z), events=at_end, rtol=1e-9, method="LSODA").t_events[0][
        0
    ]


def test_the_fold_is_passed_as_late_as_the_chain_says():
    """Without noise the delay past the fold, less the flight to r, grows as eps^(-1/3)."""
    block, late = sa.oscillator(mu=3, alpha=1), []
    for eps in (1e-3, 1e-4, 1e-5):
        time = without_noise(eps, 2.0, -0.72)
        late.append(time - block.drag_time("-0.72", str(eps)))
    # The flight is the same for each, so that differences scale.
    ratio = (late[2] - late[1]) / (late[1] - late[0])
    assert np.log10(ratio) == pytest.approx(1 / 3, abs=0.05)
