"""A survey of settled stones: depth maps of virtual cameras with noise, fused to a mesh as photographs would give it."""
import numpy as np
from numba import njit, prange
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.sparse import coo_matrix
from skimage.measure import marching_cubes

from stones import DIRECTIONS, TRIANGLES

# Cameras are so far from what they look at, metres.
DISTANCE = 1.1
# Voxels that the mesh is made wider by, and cropped to after smoothing.
MARGIN = 8
# Distances are cut off at so many voxels.
TRUNCATION = 3.5


class Sand:
    """The surface of the sand, on a grid of 1 mm."""

    step = 0.001

    def __init__(self, preset, rng):
        n = int(2 * (preset['half'] + 0.09) / self.step) + 1
        self.z = np.full((n, n), preset['sand'])
        for wave_mm, height in ((60, 0.0020), (20, 0.0006), (6, 0.0004), (2.5, 0.00015)):
            ripples = gaussian_filter(rng.normal(size=(n, n)), wave_mm / 2.5, mode='wrap')
            self.z += ripples / ripples.std() * height
        self.first = -(n - 1) / 2 * self.step

    def at(self, grid, x, y):
        """Values of a grid at places."""
        return map_coordinates(grid, [(x - self.first) / self.step, (y - self.first) / self.step], order=1, mode='nearest')

    def mesh(self):
        n = len(self.z)
        along = self.first + self.step * np.arange(n)
        x, y = np.meshgrid(along, along, indexing='ij')
        q = np.arange(n * n).reshape(n, n)
        west, east, far, north = q[:-1, :-1].ravel(), q[1:, :-1].ravel(), q[1:, 1:].ravel(), q[:-1, 1:].ravel()
        return np.c_[x.ravel(), y.ravel(), self.z.ravel()], np.r_[np.c_[west, east, far], np.c_[west, far, north]]


def stones_in_window(stones, preset):
    """Vertices, triangles and stone of each vertex, of what may be seen."""
    reach = preset['half'] + 0.08
    seen = [i for i, s in enumerate(stones) if (s['w'][:, :2].min(0) < reach).all() and (s['w'][:, :2].max(0) > -reach).all()]
    triangles = np.concatenate([TRIANGLES + k * len(DIRECTIONS) for k in range(len(seen))])
    return np.concatenate([stones[i]['w'] for i in seen]), triangles, np.repeat(seen, len(DIRECTIONS))


def survey(stone_mesh, sand, preset, rng):
    """Vertices and triangles of the mesh that the cameras give."""
    h, half = preset['voxel'], preset['half']
    stone_v, stone_f, _ = stone_mesh
    sand_v, sand_f = sand.mesh()
    scene_v, scene_f = np.r_[stone_v, sand_v], np.r_[stone_f, sand_f + len(stone_v)]
    top = stone_v[(np.abs(stone_v[:, :2]) < half + 0.01).all(1), 2].max()
    margin = MARGIN * h
    across = int(round(2 * (half + margin) / h)) + 1
    dims = (across, across, int(np.ceil((top + 0.004) / h)) + 1)
    summed, weights = np.zeros(dims, np.float32), np.zeros(dims, np.float32)
    origin = np.array([-half - margin, -half - margin, 0.0])
    inside = (np.abs(scene_v[:, :2]) < half + margin).all(1)
    for tilt, count in preset['tilts']:
        first = rng.uniform(0, 2 * np.pi)
        for k in range(count):
            camera, turn = _camera(first + 2 * np.pi * k / count, tilt, half, top, rng)
            focal = DISTANCE / preset['pixel']
            seen = (scene_v - camera) @ turn.T
            pixels = np.c_[focal * seen[:, 0] / seen[:, 2], focal * seen[:, 1] / seen[:, 2], seen[:, 2]]
            low, high = pixels[inside, :2].min(0) - 5, pixels[inside, :2].max(0) + 5
            pixels[:, :2] -= low
            width, height = (high - low).astype(int) + 1
            depth, weight = _depth_map((height, width), pixels, scene_f, preset, rng)
            _fuse(summed, weights, origin, h, turn, camera, focal, -low[0], -low[1], depth.astype(np.float32),
                  weight.astype(np.float32), TRUNCATION * h)
    # What no camera saw counts as solid.
    field = np.where(weights > preset['least_weight'], summed / np.maximum(weights, 1e-9), -1).astype(np.float32)
    field[field == 0] = 1e-5
    field[:, :, -2:] = 1
    v, f, _, _ = marching_cubes(field, 0.0, gradient_direction='ascent', allow_degenerate=False)
    v, f = v * h + origin, np.asarray(f, np.int64)
    up = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])[:, 2]
    if up[v[f[:, 0], 2] > np.percentile(v[:, 2], 90)].sum() < 0:
        f = f[:, [0, 2, 1]]
    v = _smooth(v, f, preset['passes'], preset['unshrink'])
    return v, f[(np.abs(v[:, :2]) <= half).all(1)[f].all(1)]


def _camera(azimuth, tilt_deg, half, top, rng):
    azimuth += rng.normal(0, 0.1)
    tilt = np.radians(tilt_deg + rng.normal(0, 2.0))
    away = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    camera = np.array([*rng.uniform(-0.3 * half, 0.3 * half, 2), top * 0.5]) + away * DISTANCE
    right = np.cross(-away, [0.0, 1.0, 0.0] if abs(away[2]) > 0.99 else [0, 0, 1.0])
    right /= np.linalg.norm(right)
    return camera, np.array([right, np.cross(-away, right), -away])


def _depth_map(shape, pixels, triangles, preset, rng):
    """Depths with noise that neighbours share, more where the surface is steep, and how much each counts."""
    inverse = np.zeros(shape)
    _rasterise(inverse, pixels, triangles)
    depth = np.where(inverse > 0, 1 / np.maximum(inverse, 1e-9), 0)
    if preset['blur']:
        # The depth of a coarse matcher runs over the edges.
        share = gaussian_filter((depth > 0).astype(float), preset['blur'])
        depth = np.where(depth > 0, gaussian_filter(depth, preset['blur']) / np.maximum(share, 1e-9), 0)
    down, across = np.gradient(depth)
    slope = np.hypot(across, down) / preset['pixel']
    cosine = 1 / np.sqrt(1 + slope ** 2)
    fine = gaussian_filter(rng.normal(size=shape), preset['noise_pixels'])
    fine /= fine.std()
    coarse = gaussian_filter(rng.normal(size=(shape[0] // 8 + 2, shape[1] // 8 + 2)), 3.0)
    coarse /= coarse.std()
    coarse = map_coordinates(coarse, np.meshgrid(np.arange(shape[0]) / 8, np.arange(shape[1]) / 8, indexing='ij'), order=1)
    noise = (preset['noise'] * fine + preset['bias'] * coarse) * (1 + 0.5 * np.minimum(slope, 4))
    weight = np.where((cosine > preset['least_cosine']) & (depth > 0), cosine, 0)
    return np.where(depth > 0, depth + noise, 0), weight


@njit
def _rasterise(inverse, pixels, triangles):
    """Keeps the largest 1 / depth at each pixel. `pixels`: column, row and depth of each vertex."""
    height, width = inverse.shape
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x0, y0, x1, y1, x2, y2 = (pixels[a, 0], pixels[a, 1], pixels[b, 0], pixels[b, 1], pixels[c, 0], pixels[c, 1])
        twice = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(twice) < 1e-12:
            continue
        left, right = max(int(np.ceil(min(x0, x1, x2))), 0), min(int(np.floor(max(x0, x1, x2))), width - 1)
        low, high = max(int(np.ceil(min(y0, y1, y2))), 0), min(int(np.floor(max(y0, y1, y2))), height - 1)
        for j in range(low, high + 1):
            for i in range(left, right + 1):
                w1 = ((i - x0) * (y2 - y0) - (x2 - x0) * (j - y0)) / twice
                w2 = ((x1 - x0) * (j - y0) - (i - x0) * (y1 - y0)) / twice
                if w1 < -1e-9 or w2 < -1e-9 or w1 + w2 > 1 + 1e-9:
                    continue
                at = (1 - w1 - w2) / pixels[a, 2] + w1 / pixels[b, 2] + w2 / pixels[c, 2]
                if at > inverse[j, i]:
                    inverse[j, i] = at


@njit(parallel=True)
def _fuse(summed, weights, origin, h, turn, camera, focal, shift_x, shift_y, depth, weight, truncation):
    """Adds a depth map to the truncated signed distances of the voxels."""
    nx, ny, nz = summed.shape
    height, width = depth.shape
    for i in prange(nx):
        for j in range(ny):
            for k in range(nz):
                x = origin[0] + i * h - camera[0]
                y = origin[1] + j * h - camera[1]
                z = origin[2] + k * h - camera[2]
                ahead = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
                column = int(focal * (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z) / ahead + shift_x + 0.5)
                row = int(focal * (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z) / ahead + shift_y + 0.5)
                if column < 0 or row < 0 or column >= width or row >= height:
                    continue
                if depth[row, column] <= 0 or weight[row, column] <= 0:
                    continue
                distance = (depth[row, column] - ahead) / truncation
                if distance < -1:
                    continue
                summed[i, j, k] += weight[row, column] * min(distance, 1.0)
                weights[i, j, k] += weight[row, column]


def _smooth(v, f, passes, unshrink):
    """Laplacian passes of one half; `unshrink` undoes part of the shrinking (Taubin)."""
    edges = np.r_[f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]
    ends = (np.r_[edges[:, 0], edges[:, 1]], np.r_[edges[:, 1], edges[:, 0]])
    beside = coo_matrix((np.ones(2 * len(edges), np.float32), ends), shape=(len(v),) * 2).tocsr()
    beside.data[:] = 1
    degree = np.asarray(beside.sum(1)).ravel()[:, None]
    for _ in range(passes):
        v = v + 0.5 * ((beside @ v) / degree - v)
        if unshrink:
            v = v - unshrink * ((beside @ v) / degree - v)
    return v
