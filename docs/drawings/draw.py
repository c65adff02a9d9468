"""Draws the SVG files of this folder. Standard library only.

    python3 docs/drawings/draw.py

Every drawing shows the same piece of bone in two dimensions: three round-ended struts, two of which join. Sites, bonds and
elements are found from that shape by the rules of the program, reduced to the plane.
"""

import math
import pathlib

HERE = pathlib.Path(__file__).parent
WIDE, HIGH = 7.0, 5.7
UNIT = 80
MARGIN = 20
FOOT = 92

BONE, EDGE = "#f3e3c3", "#b08a4a"
SITE, PAD, BOND = "#1f5fa8", "#b9c9dc", "#6f93bd"
GRID, TEXT, STRONG = "#d5d5d5", "#222222", "#c0392b"

# Struts: two ends and a radius. The first two join; the third passes close to the first.
STRUTS = [((-0.6, 1.05), (7.6, 4.55), 0.45), ((1.7, 6.2), (2.9, 2.5), 0.40), ((4.0, 5.0), (7.6, 5.3), 0.25)]


def gap(x, y, strut):
    """Distance to a strut's surface, negative inside."""
    (ax, ay), (bx, by), radius = strut
    dx, dy = bx - ax, by - ay
    t = max(0.0, min(1.0, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)))
    return math.hypot(x - ax - t * dx, y - ay - t * dy) - radius


def outside(x, y):
    """Distance to the nearest surface of bone, negative inside."""
    return min(gap(x, y, strut) for strut in STRUTS)


def bone(x, y):
    return outside(x, y) <= 0.0


class Drawing:
    def __init__(self, name, wide=WIDE, high=HIGH, foot=FOOT):
        self.name, self.wide, self.high, self.foot = name, wide, high, foot
        self.parts = []

    def at(self, x, y):
        return MARGIN + UNIT * x, MARGIN + UNIT * (self.high - y)

    def add(self, part):
        self.parts.append(part)

    def line(self, x0, y0, x1, y1, colour, width=1.0, more=""):
        (a, b), (c, d) = self.at(x0, y0), self.at(x1, y1)
        self.add(f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" stroke="{colour}" stroke-width="{width}" {more}/>')

    def dot(self, x, y, radius, fill, stroke="none", width=1.5):
        a, b = self.at(x, y)
        self.add(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{radius:.1f}" fill="{fill}" stroke="{stroke}" stroke-width="{width}"/>')

    def polygon(self, points, fill, stroke, width=1.0, more=""):
        words = " ".join(f"{a:.1f},{b:.1f}" for a, b in (self.at(*p) for p in points))
        self.add(f'<polygon points="{words}" fill="{fill}" stroke="{stroke}" stroke-width="{width}" {more}/>')

    def box(self, x, y, w, h, fill, stroke, width=1.0, more=""):
        self.polygon([(x, y), (x + w, y), (x + w, y + h), (x, y + h)], fill, stroke, width, more)

    def bone(self, fill=BONE, edge=EDGE):
        """The outline first, then the inside over it, so that joined struts have one outline."""
        for colour, more in ((edge, 0.03), (fill, 0.0)):
            for (a, b, radius) in STRUTS:
                (x0, y0), (x1, y1) = self.at(*a), self.at(*b)
                self.add(f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{colour}" '
                         f'stroke-width="{2 * UNIT * (radius + more):.1f}" stroke-linecap="round"/>')

    def grid(self, step):
        count = lambda length: int(length / step + 1e-9)
        for i in range(count(self.wide) + 1):
            self.line(i * step, 0, i * step, self.high, GRID)
        for j in range(count(self.high) + 1):
            self.line(0, j * step, self.wide, j * step, GRID)

    def caption(self, lines):
        self.lines = lines

    def save(self):
        width, height = 2 * MARGIN + UNIT * self.wide, 2 * MARGIN + UNIT * self.high + self.foot
        x, y = MARGIN, MARGIN
        clip = f'<clipPath id="frame"><rect x="{x}" y="{y}" width="{UNIT * self.wide:.0f}" height="{UNIT * self.high:.0f}"/></clipPath>'
        text = "".join(
            f'<text x="{MARGIN}" y="{2 * MARGIN + UNIT * self.high + 14 + 20 * i:.0f}" font-size="14" fill="{TEXT}">{line}</text>'
            for i, line in enumerate(self.lines))
        body = "\n".join(self.parts)
        (HERE / f"{self.name}.svg").write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}" '
            f'font-family="Helvetica, Arial, sans-serif">\n<rect width="100%" height="100%" fill="white"/>\n<defs>{clip}</defs>\n'
            f'<g clip-path="url(#frame)">\n{body}\n</g>\n{text}\n</svg>\n', encoding="utf-8")


def positions(lp):
    """Places of a lattice, a layer beyond the drawing included."""
    for i in range(-2, int(WIDE / lp) + 3):
        for j in range(-2, int(HIGH / lp) + 3):
            yield (i, j), ((i + 0.5) * lp, (j + 0.5) * lp)


NEIGHBOURS = [(1, 0), (0, 1), (1, 1), (1, -1)]


def bonds(drawing, sites, lp, colour=BOND, width=1.6):
    for (i, j), (x, y) in sites.items():
        for di, dj in NEIGHBOURS:
            if (i + di, j + dj) in sites:
                drawing.line(x, y, x + di * lp, y + dj * lp, colour, width)


def floppy():
    d, lp = Drawing("floppy"), 0.4
    d.bone()
    sites = {k: p for k, p in positions(lp) if bone(*p)}
    bonds(d, sites, lp)
    for x, y in sites.values():
        d.dot(x, y, 5, SITE)
    d.caption(["Floppy: a site where its position lies in bone.",
               "Surface sites lack neighbours, thin struts are one site wide: too soft while coarse."])
    d.save()


def firm():
    d, lp = Drawing("firm"), 0.4
    d.bone()
    sites = {k: p for k, p in positions(lp) if outside(*p) <= 1.1 * lp}
    bonds(d, sites, lp)
    everywhere = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    for (i, j), (x, y) in sites.items():
        full = all((i + a, j + b) in sites for a, b in everywhere)
        d.dot(x, y, 5, SITE if full else PAD, SITE, 1.2)
    d.caption(["Firm: a site where bone lies within 1.1 first-neighbour distances: bone is padded by a layer.",
               "Only sites with all their neighbours (dark) count in the stress: too stiff while coarse."])
    d.save()


def components(i, j, lp, fine=16):
    """Connected components of bone in one cell: each as a set of fine places."""
    inside = {(a, b) for a in range(fine) for b in range(fine)
              if bone((i + (a + 0.5) / fine) * lp, (j + (b + 0.5) / fine) * lp)}
    found = []
    while inside:
        queue, part = [inside.pop()], set()
        while queue:
            a, b = queue.pop()
            part.add((a, b))
            for n in ((a + 1, b), (a - 1, b), (a, b + 1), (a, b - 1)):
                if n in inside:
                    inside.remove(n)
                    queue.append(n)
        if len(part) > 0.01 * fine * fine:
            found.append(part)
    return found


def connected():
    d, lp, fine = Drawing("connected"), 0.9, 16
    d.bone()
    d.grid(lp)
    cells = {(i, j): components(i, j, lp, fine) for i in range(-1, 9) for j in range(-1, 7)}

    def middle(i, j, part):
        n = len(part)
        return ((i + sum(a + 0.5 for a, _ in part) / fine / n) * lp, (j + sum(b + 0.5 for _, b in part) / fine / n) * lp)

    def share(part, axis):
        return len({q[1 - axis] for q in part}) / fine

    for (i, j), parts in cells.items():
        for part in parts:
            for axis, (di, dj) in enumerate(((1, 0), (0, 1))):
                for other in cells.get((i + di, j + dj), []):
                    last = {q[1 - axis] for q in part if q[axis] == fine - 1}
                    first = {q[1 - axis] for q in other if q[axis] == 0}
                    if last & first:
                        width = 2 + 8 * len(last & first) / fine
                        d.line(*middle(i, j, part), *middle(i + di, j + dj, other), BOND, width)
    for (i, j), parts in cells.items():
        for part in parts:
            d.dot(*middle(i, j, part), 7, STRONG if len(parts) > 1 else SITE)
    d.caption(["Connected: a site for each connected component of bone in a cell.",
               "Bonds are as strong as the bone along them. Red: two that share a cell but do not touch."])
    d.save()


def weighted():
    d, lp, fine = Drawing("weighted"), 0.5, 10
    d.bone()
    d.grid(lp)
    weights = {}
    for (i, j), p in positions(lp):
        inside = sum(bone((i + (a + 0.5) / fine) * lp, (j + (b + 0.5) / fine) * lp) for a in range(fine) for b in range(fine))
        if inside / fine**2 > 0.02:
            weights[(i, j)] = (p, inside / fine**2)
    for (i, j), ((x, y), w) in weights.items():
        for di, dj in NEIGHBOURS:
            other = weights.get((i + di, j + dj))
            if other:
                d.line(x, y, *other[0], BOND, 0.4 + 2.2 * 0.5 * (w + other[1]))
    for (x, y), w in weights.values():
        d.dot(x, y, 1.5 + 5.5 * w, SITE)
    d.caption(["Weighted: one site a cell, weighted by the share of bone in the cell (size of the dot).",
               "Drawn on squares; the program offers it on BCC and FCC lattices."])
    d.save()


def voxel_fe():
    d, h = Drawing("voxel-fe"), 0.2
    for i in range(int(WIDE / h + 1e-9)):
        for j in range(int(HIGH / h + 1e-9)):
            if bone((i + 0.5) * h, (j + 0.5) * h):
                d.box(i * h, j * h, h, h, BONE, EDGE, 0.8)
    for strut in STRUTS:
        outline(d, strut)
    d.caption(["Voxel FE: one hexahedron for each bone voxel.",
               "Its surface is a staircase (dashed: the bone's surface)."])
    d.save()


def outline(d, strut):
    """The part of a strut's surface that no other strut covers."""
    (ax, ay), (bx, by), radius = strut
    length = math.hypot(bx - ax, by - ay)
    tx, ty = (bx - ax) / length, (by - ay) / length
    steps = 400
    for side in (-1, 1):
        last = None
        for k in range(steps + 1):
            x = ax + tx * length * k / steps - side * ty * radius
            y = ay + ty * length * k / steps + side * tx * radius
            free = all(gap(x, y, other) > 0 for other in STRUTS if other is not strut)
            if free and last and (k // 5) % 2 == 0:
                d.line(*last, x, y, STRONG, 1.8)
            last = (x, y) if free else None


def geometry_fe():
    d, h = Drawing("geometry-fe"), 0.26
    rise = h * math.sqrt(3) / 2

    def place(i, j):
        x, y = i * h + (j % 2) * h / 2, j * rise
        s = outside(x, y)
        if abs(s) < 0.5 * h:  # near vertices move to the surface
            e = 1e-4
            gx = (outside(x + e, y) - outside(x - e, y)) / (2 * e)
            gy = (outside(x, y + e) - outside(x, y - e)) / (2 * e)
            n = math.hypot(gx, gy) or 1.0
            x, y = x - s * gx / n, y - s * gy / n
        return x, y

    for j in range(-1, int(HIGH / rise) + 2):
        for i in range(-2, int(WIDE / h) + 2):
            right = i + 1
            up = (i + j % 2, j + 1)
            for corners in (((i, j), (right, j), up), ((right, j), (up[0] + 1, j + 1), up)):
                points = [place(*c) for c in corners]
                x, y = (sum(p[k] for p in points) / 3 for k in (0, 1))
                if outside(x, y) < -1e-3 and all(outside(*p) < 0.2 * h for p in points):
                    d.polygon(points, BONE, EDGE, 0.8)
    d.caption(["Geometry-based FE: a smooth surface from grey values, filled with quadratic tetrahedra.",
               "(Only where your version of the program has it: see `bonepd-ct solve --help`.)"])
    d.save()


def lattice():
    d = Drawing("lattice", 7.0, 3.6, 92)
    lp, cx, cy = 1.25, 1.8, 1.8
    for a in (-1, 0, 1):
        for b in (-1, 0, 1):
            if (a, b) != (0, 0):
                near = a == 0 or b == 0
                d.line(cx, cy, cx + a * lp, cy + b * lp, SITE if near else BOND, 3 if near else 2, "" if near else 'stroke-dasharray="7 5"')
    for a in (-1, 0, 1):
        for b in (-1, 0, 1):
            d.dot(cx + a * lp, cy + b * lp, 9, SITE)
    d.line(cx, 0.25, cx + lp, 0.25, TEXT, 1.5)
    label(d, cx + lp / 2, 0.05, "LP")
    label(d, 5.05, 3.1, "energy of a site", "middle", 17)
    label(d, 5.05, 2.55, "½ Σ kₛ δ²  of its springs")
    label(d, 5.05, 2.15, "first neighbours (solid) and second (dashed)")
    label(d, 5.05, 1.55, "+ ½ T Σ (Σ δ)²  of each shell")
    label(d, 5.05, 1.15, "volume change; 0 at Poisson's ratio ¼")
    d.caption(["Lattice element method: sites joined to their first and second neighbours.",
               "LP is the lattice parameter. A whole lattice stores the energy of the isotropic solid (E, ν)."])
    d.save()


def label(d, x, y, text, anchor="middle", size=14):
    a, b = d.at(x, y)
    d.add(f'<text x="{a:.1f}" y="{b:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{TEXT}">{text}</text>')


def conditions():
    d = Drawing("conditions", 9.0, 3.7, 66)
    names = ["ends free", "ends bonded", "grips", "confined"]
    for k, name in enumerate(names):
        x = 0.45 + 2.25 * k
        # A compressed block: free ends stay straight, bonded ends keep their width.
        if name == "ends free":
            shape = [(x - 0.1, 0.6), (x + 1.4, 0.6), (x + 1.4, 2.9), (x - 0.1, 2.9)]
        elif name == "confined":
            shape = [(x, 0.6), (x + 1.3, 0.6), (x + 1.3, 2.9), (x, 2.9)]
        else:
            flat = 0.55 if name == "grips" else 0.0
            right = []
            for s in range(21):
                t = s / 20
                y = 0.6 + 2.3 * t
                inner = max(0.0, min(1.0, (y - 0.6 - flat) / (2.3 - 2 * flat)))
                right.append((x + 1.3 + 0.14 * math.sin(math.pi * inner), y))
            shape = [*right, *((2 * x + 1.3 - px, py) for px, py in reversed(right))]
        d.polygon(shape, BONE, EDGE, 1.5)
        d.box(x - 0.2, 2.9, 1.7, 0.14, "#888888", "none")
        d.box(x - 0.2, 0.46, 1.7, 0.14, "#888888", "none")
        if name == "grips":
            for y in (0.6, 2.35):
                d.box(x - 0.01, y, 1.32, 0.55, "#888888", "none", 1, 'fill-opacity="0.45"')
        if name == "confined":
            for side in (x - 0.14, x + 1.3):
                d.box(side, 0.6, 0.14, 2.3, "#888888", "none")
        if name == "ends bonded":
            for y in (0.6, 2.9):
                for s in range(7):
                    d.dot(x + 0.1 + 1.1 * s / 6, y, 3.2, STRONG)
        d.line(x + 0.65, 3.6, x + 0.65, 3.2, STRONG, 3)
        d.polygon([(x + 0.55, 3.24), (x + 0.75, 3.24), (x + 0.65, 3.06)], STRONG, "none")
        label(d, x + 0.65, 0.12, name)
    d.caption(["Free: the ends slide sideways. Bonded: they do not. Grips: the outer T mm at each end moves as one.",
               "Confined: the sides do not move outward."])
    d.save()


def steps():
    d = Drawing("steps", 9.0, 1.7, 14)
    for k, (name, below) in enumerate([("scan", "grey values"), ("segment", "mask, BV/TV"), ("model", "lattice or elements"),
                                       ("solve", "E_app ± error"), ("report", "tables, page")]):
        x = 0.05 + 1.82 * k
        d.box(x, 0.5, 1.45, 0.9, BONE if k % 4 else "#e8eef6", EDGE if k % 4 else SITE, 1.5)
        label(d, x + 0.725, 0.87, name, "middle", 17)
        label(d, x + 0.725, 0.16, below, "middle", 14)
        if k < 4:
            d.line(x + 1.47, 0.95, x + 1.72, 0.95, TEXT, 2)
            d.polygon([(x + 1.7, 1.02), (x + 1.7, 0.88), (x + 1.81, 0.95)], TEXT, "none")
    d.caption([])
    d.save()


if __name__ == "__main__":
    for draw in (steps, lattice, floppy, firm, connected, weighted, voxel_fe, geometry_fe, conditions):
        draw()
