"""Local references of the unit square of reports/remodelling.md: one point, one energy law, implicit Euler (PyPI: scipy).

    python3 reports/remodelling/local_limits.py

The edges move by 0.060, 0.075, 0.090, 0.105, the sides are free, dt = 0.1. Prints (rho - rho*)/rho* at t = 2, 4, 6, 8. Shares no code with the
program.
"""

import math

from scipy.optimize import brentq

STEPS = [0.06, 0.075, 0.09, 0.105]


def lame(nu):
    return nu / ((1 + nu) * (1 - nu)), 0.5 / (1 + nu)


def st_venant_kirchhoff(nu):
    l, m = lame(nu)

    def energy(a, b):
        e, f = 0.5 * (a * a - 1), 0.5 * (b * b - 1)
        return 0.5 * l * (e + f) ** 2 + m * (e * e + f * f)

    return energy


def neo_hooke(nu):
    l, m = lame(nu)
    return lambda a, b: 0.5 * m * (a * a + b * b - 2 - 2 * math.log(a * b)) + 0.5 * l * math.log(a * b) ** 2


def circle(n=720):
    angles = [2 * math.pi * (k + 0.5) / n for k in range(n)]
    return [((math.cos(t), math.sin(t)), 1 / n) for t in angles]


def stencil(ratio):
    reach = range(-int(ratio), int(ratio) + 1)
    bonds = [(i, j, math.hypot(i, j)) for i in reach for j in reach if 0 < math.hypot(i, j) <= ratio]
    whole = sum(length for *_, length in bonds)
    return [((i / length, j / length), length / whole) for i, j, length in bonds]


def bonds(nu, directions):
    """2 (lambda + mu) <s^2> + 2 (mu - lambda) <gamma^2>; by symmetry the point does not turn."""
    l, m = lame(nu)

    def energy(a, b):
        total = 0.0
        for (x, y), share in directions:
            s = math.hypot(a * x, b * y) - 1
            gamma = math.atan2(x * b * y - y * a * x, x * a * x + y * b * y)
            total += share * (2 * (l + m) * s * s + 2 * (m - l) * gamma * gamma)
        return total

    return energy


def densities(energy, rate=1000.0, stimulus=0.01, dt=0.1):
    def stored(u):
        along = 1 + 2 * u
        across = lambda a: (energy(a + 1e-6, along) - energy(a - 1e-6, along)) / 2e-6
        return energy(brentq(across, 0.6, 1.4, xtol=1e-14), along)

    found, rho = [], 1.0
    for u in STEPS:
        psi = stored(u)
        for _ in range(20):
            old = rho
            rho = brentq(lambda r: -r + old + rate * dt * (psi / r - stimulus), 1e-6, 50, xtol=1e-15)
        found.append(f"{rho - 1:.6f}")
    return ", ".join(found)


for name, energy in [
    ("St. Venant-Kirchhoff, any nu", st_venant_kirchhoff(1 / 3)),
    *[(f"Neo-Hooke, nu = {nu}", neo_hooke(nu)) for nu in (0.2, 0.3)],
    *[
        (f"bonds, nu = {nu:.4g}, {kind}", bonds(nu, directions))
        for nu in (0.2, 0.3, 1 / 3)
        for kind, directions in (("full circle", circle()), ("delta/Delta = 3.01", stencil(3.01)))
    ],
]:
    print(f"{name}: {densities(energy)}")
