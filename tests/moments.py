"""Watson's coefficients by moments, which share no step with Lagrange's reversion."""

from __future__ import annotations

from typing import Any


def moment_coefficients(f: Any, g: Any, contact: int, beta: Any = 1, *, step: int = 1) -> list[Any]:
    """d_0, d_step, ...: the exponential expanded beside -a t^mu, term by term (J. Wojdylo).

    d_k = sum over j and m of g[k - j] B[m][j] (-1)^m (s)_m/m!, s = (k + beta)/mu,
    B[m][j] = [t^j] (alpha_1 t + ...)^m, alpha_j = f[mu + j]/f[mu].
    """
    count = min(len(f) - contact, len(g))
    alpha = [0, *(x / f[contact] for x in f[contact + 1 : contact + count])]
    powers = [[g[0] * 0 + 1, *[g[0] * 0] * (count - 1)]]
    for _ in range(1, count):
        last = powers[-1]
        powers.append([sum(alpha[i] * last[j - i] for i in range(1, j + 1)) for j in range(count)])
    reduced = []
    for k in range(0, count, step):
        total, rising = g[0] * 0, g[0] * 0 + 1
        for m in range(k + 1):
            total += rising * sum(g[k - j] * powers[m][j] for j in range(m, k + 1))
            rising = rising * (k + beta + contact * m) / (-contact * (m + 1))
        reduced.append(total)
    return reduced
