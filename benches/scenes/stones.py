"""Stones: rounded blocks, some of them cut by facets, with noise; triangle meshes about their centre of mass, metres."""
import numpy as np

# Golden ratio: corners of an icosahedron.
_T = (1 + 5 ** 0.5) / 2
_CORNERS = [(-1, _T, 0), (1, _T, 0), (-1, -_T, 0), (1, -_T, 0), (0, -1, _T), (0, 1, _T),
            (0, -1, -_T), (0, 1, -_T), (_T, 0, -1), (_T, 0, 1), (-_T, 0, -1), (-_T, 0, 1)]
_FACES = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
          (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7),
          (9, 8, 1)]


def unit_ball(halvings):
    """Vertices and triangles of a ball of radius 1; the first vertices are those of the ball with fewer halvings."""
    v, f = np.array(_CORNERS, float), np.array(_FACES)
    for _ in range(halvings):
        edges = np.sort(np.r_[f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]], 1)
        unique, which = np.unique(edges, axis=0, return_inverse=True)
        middle = len(v) + which.ravel().reshape(3, -1).T
        v = np.r_[v, (v[unique[:, 0]] + v[unique[:, 1]]) / 2]
        a, b, c = f.T
        ab, bc, ca = middle.T
        f = np.r_[np.c_[a, ab, ca], np.c_[b, bc, ab], np.c_[c, ca, bc], middle]
        v /= np.linalg.norm(v, axis=1)[:, None]
    return v / np.linalg.norm(v, axis=1)[:, None], f


DIRECTIONS, TRIANGLES = unit_ball(5)
# Vertices of the hull that the physics sees: the first of DIRECTIONS.
HULL_VERTICES = len(unit_ball(2)[0])


def _areas(v):
    """Area around each vertex, the whole area, and the volume."""
    corners = v[TRIANGLES]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    volume = np.einsum('ij,ij->i', corners[:, 0], normals).sum() / 6
    return np.bincount(TRIANGLES.ravel(), np.repeat(areas / 3, 3), len(v)), areas.sum(), volume


def draw_b_axis(rng, kind):
    """A b axis, metres: `kind` is the law, its median and its spread in ln b, the smallest and the largest."""
    law, median, spread, lowest, highest = kind
    while True:
        b = lowest * (highest / lowest) ** rng.random() if law == 'even' else median * np.exp(spread * rng.normal())
        if lowest <= b <= highest:
            return b


def make_stone(rng, preset):
    """A stone: vertices, full axes, their directions (rows), volume and area."""
    b = draw_b_axis(rng, preset['b'])
    b_over_a = np.clip(rng.normal(*preset['b_over_a']), 0.48, 0.96)
    c_over_b = np.clip(rng.normal(*preset['c_over_b']), 0.34, 0.96)
    semi = np.array([1 / b_over_a, 1, c_over_b])
    # Between an ellipsoid (2) and a box.
    power = rng.uniform(2.0, 2.9)
    shape = (np.abs(DIRECTIONS / semi) ** power).sum(1) ** (1 / power)
    if rng.random() < preset['facets']:
        count = rng.integers(5, 14)
        planes = rng.normal(size=(count, 3))
        planes /= np.linalg.norm(planes, axis=1)[:, None]
        heights = np.linalg.norm(planes * semi, axis=1) * rng.uniform(0.66, 0.95, count)
        # Higher is sharper at the edges between facets.
        sharp = rng.uniform(9, 26)
        shape = (shape ** sharp + (np.maximum(DIRECTIONS @ planes.T / heights, 0) ** sharp).sum(1)) ** (1 / sharp)
        rough = rng.uniform(0.005, 0.02)
    else:
        rough = rng.uniform(0.005, 0.03)
    noise = np.zeros(len(DIRECTIONS))
    for wave, weight in ((1.2, 1.0), (2.4, 0.5), (5, 0.15), (11, 0.04)):
        k = rng.normal(size=(24, 3)) * wave
        noise += weight * np.cos(DIRECTIONS @ k.T + rng.uniform(0, 2 * np.pi, 24)).sum(1) / 12 ** 0.5
    v = DIRECTIONS / shape[:, None] * (1 + rough * noise)[:, None]
    around, area, volume = _areas(v)
    wedge = (np.cross(v[TRIANGLES[:, 0]], v[TRIANGLES[:, 1]]) * v[TRIANGLES[:, 2]]).sum(1) / 6
    v = v - ((v[TRIANGLES].sum(1) / 4) * wedge[:, None]).sum(0) / wedge.sum()
    centred = v - (v * around[:, None]).sum(0) / around.sum()
    axes = np.linalg.svd((centred * around[:, None]).T @ centred)[2]
    if np.linalg.det(axes) < 0:
        axes[2] *= -1
    lengths = np.ptp(centred @ axes.T, axis=0)
    scale = b / lengths[1]
    return dict(v=v * scale, abc=lengths * scale, rot=axes, vol=volume * scale ** 3, area=area * scale ** 2)
