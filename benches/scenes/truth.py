"""What the surveyed mesh shows: the stone of each triangle and vertex, and a table of the stones."""
import csv

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

SAND, MEMBRANE = -1, -2
# Further than this from all true surfaces a mesh has a hole instead of a membrane, metres.
HOLE = 0.012
# Loose pieces of fewer triangles are left out.
LEAST_PIECE = 300
COLUMNS = ('id ref visible cut visible_area strict_area component_area represented_ratio A B C '
           'r00 r01 r02 r10 r11 r12 r20 r21 r22 cx cy cz volume area').split()


class TrueSurface:
    """The true stones and the sand, to be asked what lies nearest to a place."""

    def __init__(self, stone_mesh, sand, tolerance):
        self.v, f, self.stone = stone_mesh
        self.sand, self.tolerance, self.tree = sand, tolerance, cKDTree(self.v)
        faces = np.cross(self.v[f[:, 1]] - self.v[f[:, 0]], self.v[f[:, 2]] - self.v[f[:, 0]])
        self.normals = np.zeros((len(self.v), 3))
        for corner in range(3):
            for axis in range(3):
                self.normals[:, axis] += np.bincount(f[:, corner], faces[:, axis], len(self.v))
        self.normals /= np.maximum(np.linalg.norm(self.normals, axis=1), 1e-20)[:, None]

    def nearest(self, places):
        """Strictly what lies within the tolerance (stone, SAND or MEMBRANE); at best the stone if any does, and SAND for a membrane;
        and how far the nearest surface is."""
        to_stone, stone = np.empty(len(places)), np.empty(len(places), int)
        for first in range(0, len(places), 200_000):
            some = places[first:first + 200_000]
            _, near = self.tree.query(some, k=5, workers=2)
            offset = some[:, None] - self.v[near]
            off_plane = np.abs((offset * self.normals[near]).sum(2))
            along = np.sqrt(np.maximum((offset ** 2).sum(2) - off_plane ** 2, 0))
            distance = np.sqrt(off_plane ** 2 + np.maximum(along - 0.0012, 0) ** 2)
            best = distance.argmin(1)
            rows = np.arange(len(some))
            to_stone[first:first + len(some)] = distance[rows, best]
            stone[first:first + len(some)] = self.stone[near[rows, best]]
        to_sand = self._to_sand(places)
        far = np.minimum(to_stone, to_sand) > self.tolerance
        strict = np.where(far, MEMBRANE, np.where(to_stone <= to_sand, stone, SAND))
        on_stone = (strict == SAND) & (to_stone <= self.tolerance)
        best = np.where(strict == MEMBRANE, SAND, np.where(on_stone, stone, strict))
        return strict.astype(np.int32), best.astype(np.int32), np.minimum(to_stone, to_sand)

    def _to_sand(self, places):
        sand = self.sand
        x, y = [(places[:, i] - sand.first) / sand.step for i in (0, 1)]
        slope = np.hypot(*[map_coordinates(g, [x, y], order=1) for g in np.gradient(sand.z, sand.step)])
        return np.abs(places[:, 2] - sand.at(sand.z, places[:, 0], places[:, 1])) / np.sqrt(1 + slope ** 2)


def clean(v, f, truth):
    """The mesh without wide membranes, loose pieces and edges of more than two triangles, with strict and best labels of its
    triangles and best labels of its vertices."""
    strict, best, distance = truth.nearest(v[f].mean(1))
    keep = distance < HOLE
    f, strict, best = f[keep], strict[keep], best[keep]
    edges = np.r_[f[:, [0, 1]], f[:, [1, 2]]]
    graph = coo_matrix((np.ones(len(edges), np.int8), (edges[:, 0], edges[:, 1])), shape=(len(v),) * 2)
    _, piece = connected_components(graph, directed=False)
    keep = np.bincount(piece[f[:, 0]], minlength=piece.max() + 1)[piece[f[:, 0]]] >= LEAST_PIECE
    f, strict, best = f[keep], strict[keep], best[keep]
    for _ in range(3):
        _, which, count = np.unique(_edge_keys(f, len(v)), return_inverse=True, return_counts=True)
        bad = (count[which.ravel()] > 2).reshape(3, -1).any(0)
        f, strict, best = f[~bad], strict[~bad], best[~bad]
        if not bad.any():
            break
    used, f = np.unique(f, return_inverse=True)
    v, f = v[used].astype(np.float32), f.reshape(-1, 3)
    return v, f, strict, best, truth.nearest(v.astype(float))[1]


def _edge_keys(f, vertices):
    edges = np.sort(np.r_[f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]], 1)
    return edges[:, 0] * vertices + edges[:, 1]


def triangle_areas(v, f):
    corners = v.astype(float)[f]
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def largest_pieces(v, f, strict, areas, stones):
    """Of each stone the largest area that hangs together by edges."""
    keys = _edge_keys(f, len(v))
    order = np.argsort(keys, kind='stable')
    triangle, keys = np.tile(np.arange(len(f)), 3)[order], keys[order]
    pair = np.where(keys[1:] == keys[:-1])[0]
    one, other = triangle[pair], triangle[pair + 1]
    same = (strict[one] == strict[other]) & (strict[one] >= 0)
    graph = coo_matrix((np.ones(same.sum(), np.int8), (one[same], other[same])), shape=(len(f),) * 2)
    pieces, piece = connected_components(graph, directed=False)
    area, stone = np.bincount(piece, areas, pieces), np.full(pieces, -1)
    stone[piece] = strict
    largest = np.zeros(stones)
    np.maximum.at(largest, stone[stone >= 0], area[stone >= 0])
    return largest


def write_table(path, stones, mesh, half, area_threshold):
    """Writes truth.csv and gives its rows. A stone is visible if at least three smallest grains of it hang together."""
    v, f, strict, best, _ = mesh
    areas, count = triangle_areas(v, f), len(stones)
    piece = largest_pieces(v, f, strict, areas, count)
    shown, surely = [np.bincount(of[of >= 0], areas[of >= 0], count) for of in (best, strict)]
    rows = []
    for i, s in enumerate(stones):
        cut = int((np.abs(s['w'][:, :2]) > half).any())
        visible = int(piece[i] >= 3 * area_threshold)
        rows.append([i, 0, visible, cut, shown[i], surely[i], piece[i], shown[i] / s['area'], *s['abc'], *s['rw'].ravel(),
                     *s['x'], s['vol'], s['area']])
    with open(path, 'w', newline='') as out:
        writer = csv.writer(out, lineterminator='\n')
        writer.writerow(COLUMNS)
        writer.writerows([[x if isinstance(x, int) else f'{x:.9g}' for x in row] for row in rows])
    return rows
