"""Kink angles of two criteria for a fully anisotropic body and silicon, uniform toughness (PyPI: numpy): the largest hoop
stress, and the largest energy release rate, of the hoop and shear intensities on a ray taken as those of a short kink.

    python3 reports/continuum-molecular/kinks.py
"""

import numpy as np

BODIES = {"fully anisotropic": (100, 80, 20, 33.4, 10, 16.7), "silicon": (141.1, 141.1, 39.3, 79.6, 0, 0)}
ANGLES = np.radians(np.arange(-120, 60.01, 0.1))


def roots(s):
    """Lekhnitskii's roots with positive imaginary part."""
    mu = np.roots([s[0, 0], -2 * s[0, 2], 2 * s[0, 1] + s[2, 2], -2 * s[1, 2], s[1, 1]])
    return mu[mu.imag > 0]


def seen(c, t):
    """Compliance in axes turned by t."""
    x, y = np.cos(t), np.sin(t)
    strain = np.array([[x * x, y * y, x * y], [y * y, x * x, -x * y], [-2 * x * y, 2 * x * y, x * x - y * y]])
    return strain @ np.linalg.inv(c) @ strain.T


def kinks(moduli):
    c11, c22, c12, c66, c16, c26 = moduli
    c = np.array([[c11, c12, c16], [c12, c22, c26], [c16, c26, c66]])
    m1, m2 = roots(seen(c, 0))
    rays = [(t, s, roots(s)) for t in ANGLES for s in [seen(c, t)]]
    for mixity in range(0, 91, 10):
        k1, k2 = np.cos(np.radians(mixity)), np.sin(np.radians(mixity))
        hoop, energy = [], []
        for t, s, (a, b) in rays:
            x, y, d = np.cos(t), np.sin(t), m1 - m2
            g1, g2 = (1 / np.sqrt(x + m * y + 0j) for m in (m1, m2))
            s11 = (k1 * m1 * m2 * (m2 * g2 - m1 * g1) / d + k2 * (m2 * m2 * g2 - m1 * m1 * g1) / d).real
            s22 = (k1 * (m1 * g2 - m2 * g1) / d + k2 * (g2 - g1) / d).real
            s12 = (k1 * m1 * m2 * (g1 - g2) / d + k2 * (m1 * g1 - m2 * g2) / d).real
            open_, slide = s11 * y * y + s22 * x * x - 2 * s12 * x * y, (s22 - s11) * x * y + s12 * (x * x - y * y)
            rate = (-0.5 * s[1, 1] * open_ * ((a + b) * open_ + slide) / (a * b)).imag
            rate += (0.5 * s[0, 0] * slide * ((a + b) * slide + a * b * open_)).imag
            hoop.append(open_)
            energy.append(rate if open_ > 0 else 0)
        yield mixity, *(np.degrees(ANGLES[np.argmax(v)]) for v in (hoop, energy))


for name, moduli in BODIES.items():
    for mixity, hoop, energy in kinks(moduli):
        print(f"{name}, mixity {mixity}: largest hoop stress {hoop:.1f}, largest energy release rate {energy:.1f} degrees")
