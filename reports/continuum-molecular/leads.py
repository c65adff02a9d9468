"""Where current leads and probes would have to sit for the potential ratios of the paper's Figure 39 (PyPI: numpy, scipy).

    python3 reports/continuum-molecular/leads.py

The compact tension specimen of pipelines/scene-compact-tension-0.toml by bilinear finite elements of 0.15 mm, upper half: zero on the
ligament, insulated elsewhere. A pair of leads and a pair of probes, each mirrored at the crack's plane, may sit at any two nodes of the
outer edge and of the crack's mouth. Crack extensions are those of the scene at the paper's openings of 0.169, 0.211 and 0.348 mm.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

H, LEFT, RIGHT, TOP = 0.15, -6.45, 25.8, 15.48
HOLE, RADIUS, TIP = (0.0, 7.095), 3.225, 9.288
K = (1 / 170.0, 1 / 540.0)
EXTENSIONS = {0.169: 2.86, 0.211: 7.06, 0.348: 12.16}
PAPER = np.array([1.03, 1.10, 1.16])

nx, ny = round((RIGHT - LEFT) / H), round(TOP / H)
x, y = LEFT + H * np.arange(nx + 1), H * np.arange(ny + 1)
number = np.arange((nx + 1) * (ny + 1)).reshape(nx + 1, ny + 1)
# Of a square with conductivities K along its sides.
a, b = K
X = np.array([[2, -2, -1, 1], [-2, 2, 1, -1], [-1, 1, 2, -2], [1, -1, -2, 2]]) / 6
Y = np.array([[2, 1, -1, -2], [1, 2, -2, -1], [-1, -2, 2, 1], [-2, -1, 1, 2]]) / 6
ELEMENT = a * X + b * Y


def matrix():
    ci, cj = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    middle = np.hypot(x[ci] + H / 2 - HOLE[0], y[cj] + H / 2 - HOLE[1])
    keep = middle > RADIUS
    ci, cj = ci[keep], cj[keep]
    nodes = np.stack([number[ci, cj], number[ci + 1, cj], number[ci + 1, cj + 1], number[ci, cj + 1]])
    rows, columns = np.repeat(nodes, 4, axis=0), np.tile(nodes, (4, 1))
    values = np.repeat(ELEMENT.reshape(16, 1), nodes.shape[1], axis=1)
    n = number.size
    return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), (n, n))


def green(A, tip, places):
    """Potentials at `places` (columns) of unit currents into `places`."""
    held = np.zeros(number.size, bool)
    held[number[x >= tip, 0]] = True
    free = ~held & (A.diagonal() > 0)
    at = -np.ones(number.size, int)
    at[free] = np.arange(free.sum())
    factor = splu(A[free][:, free].tocsc())
    right = np.zeros((free.sum(), len(places)))
    right[at[places], np.arange(len(places))] = 1.0
    return factor.solve(right)[at[places]]


def main():
    A = matrix()
    edge = [number[0, j] for j in range(2, ny + 1, 4)] + [number[i, ny] for i in range(4, nx, 6)] + [number[nx, j] for j in range(ny, 3, -4)]
    mouth = [number[i, 0] for i in range(0, nx, 6) if x[i] < TIP - 0.5]
    places = np.array(edge + mouth)
    where = [(x[p // (ny + 1)], y[p % (ny + 1)]) for p in places]
    first = green(A, TIP, places)
    ratios = np.stack([green(A, TIP + e, places) / first for e in EXTENSIONS.values()])
    off = np.abs(ratios - PAPER[:, None, None]).max(axis=0)
    scene = (int(np.argmin([np.hypot(px + 6.45, py - 15.2) for px, py in where])), int(np.argmin([np.hypot(px + 6.3, py - 0.45) for px, py in where])))
    for name, (lead, probe) in {"the scene": scene, "nearest to the paper": np.unravel_index(off.argmin(), off.shape)}.items():
        found = ", ".join(f"{v:.3f}" for v in ratios[:, lead, probe])
        print(f"{name}: leads at ({where[lead][0]:.2f}, ±{where[lead][1]:.2f}), probes at ({where[probe][0]:.2f}, ±{where[probe][1]:.2f}) mm: {found}")
    low, high = ratios.min(axis=(1, 2)), ratios.max(axis=(1, 2))
    print("of all pairs, lowest and highest:", ", ".join(f"{u} mm {a:.3f} to {b:.3f}" for u, a, b in zip(EXTENSIONS, low, high)))
    near = np.abs(ratios[0] - PAPER[0]) < 0.005
    if near.any():
        later = ratios[1:, near]
        print(f"pairs with {PAPER[0]} at the first opening: {later[0].min():.3f} to {later[0].max():.3f} at the second (paper {PAPER[1]}), "
              f"{later[1].min():.3f} to {later[1].max():.3f} at the third (paper {PAPER[2]})")


main()
