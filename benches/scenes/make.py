"""Makes a scene with known stones: mesh.ply, and truth.csv and truth.npz as `gravelometer validate` reads them.

Stones settle in a box, are partly buried in sand, seen by virtual cameras from above, and fused to a mesh with noise and
smoothing as photographs give. Lengths are metres. The same preset and seed give the same scene where pybullet settles alike;
`--settled` keeps how the stones lie.
"""
import argparse
import json
import pickle
from pathlib import Path

import numpy as np

from settling import settle
from stones import make_stone
from survey import Sand, stones_in_window, survey
from truth import TrueSurface, clean, triangle_areas, write_table

# Many photographs: straight down, from 25 and from 44 degrees. `tilts`: degrees and cameras; `noise`, `bias`: of a depth, metres.
MANY = dict(tilts=((0, 1), (25, 8), (44, 14)), pixel=0.0005, noise=0.0007, noise_pixels=2.0, bias=0.0002, passes=10,
            unshrink=0.45, least_weight=0.8, least_cosine=0.12, blur=0.0)
FEW = dict(tilts=((0, 1), (7, 7)), pixel=0.0008, noise=0.0010, noise_pixels=2.0, bias=0.0004, passes=12, unshrink=0.0,
           least_weight=0.2, least_cosine=0.02, blur=1.5)
# `box`: half its width; `half`: that of the window; `sand`: its height; `b`: see `draw_b_axis`; ratios: mean and spread.
PRESETS = {
    'sandbox': dict(MANY, stones=370, box=0.25, half=0.11, voxel=0.0008, sand=0.0125, facets=0.45,
                    b=('normal', 0.0225, 0.42, 0.0145, 0.108), c_over_b=(0.67, 0.15), b_over_a=(0.735, 0.105)),
    'packed': dict(MANY, stones=540, box=0.23, half=0.11, voxel=0.0008, sand=0.003, facets=0.3,
                   b=('normal', 0.0275, 0.32, 0.0142, 0.069), c_over_b=(0.51, 0.11), b_over_a=(0.74, 0.10)),
    'coarse': dict(MANY, stones=67, box=0.245, half=0.25, voxel=0.0009, sand=0.010, facets=0.4,
                   b=('even', 0, 0, 0.019, 0.075), c_over_b=(0.69, 0.10), b_over_a=(0.715, 0.075), apart=True),
    'wide': dict(MANY, stones=545, box=0.25, half=0.15, voxel=0.0009, sand=0.005, facets=0.3, noise=0.0005,
                 least_weight=1.6, b=('normal', 0.0195, 0.66, 0.008, 0.120), c_over_b=(0.68, 0.14),
                 b_over_a=(0.74, 0.105), area_threshold=4e-5),
}
PRESETS['low'] = dict(PRESETS['sandbox'], **FEW, half=0.125, voxel=0.001, sand=0.0105)
# Sandboxes have two large stones.
LARGE = ('even', 0, 0, 0.05, 0.1)
# What lies further than so many voxels from all true surfaces is a membrane.
TOLERANCE = 2.5


def settled_stones(name, preset, seed, kept):
    """The stones where they lie; from the file `kept` if it is there."""
    if kept and kept.exists():
        return pickle.loads(kept.read_bytes())
    rng = np.random.default_rng([seed, 77, sum(map(ord, name))])
    stones = [make_stone(rng, preset) for _ in range(preset['stones'])]
    if name in ('sandbox', 'low'):
        stones[:2] = [make_stone(rng, dict(preset, b=LARGE)) for _ in range(2)]
    settle(stones, preset, rng)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(pickle.dumps(stones))
    return stones


def write_mesh(path, v, f, stone_of_vertex, stones):
    palette = np.random.default_rng(5).integers(90, 200, (stones + 1, 3)).astype('u1')
    palette[-1] = (190, 175, 140)
    vertices = np.zeros(len(v), [('place', '<f4', 3), ('color', 'u1', 3)])
    vertices['place'], vertices['color'] = v, palette[stone_of_vertex]
    faces = np.zeros(len(f), [('count', 'u1'), ('corners', '<i4', 3)])
    faces['count'], faces['corners'] = 3, f
    header = ['ply', 'format binary_little_endian 1.0', f'element vertex {len(v)}']
    header += [f'property float {axis}' for axis in 'xyz'] + [f'property uchar {color}' for color in ('red', 'green', 'blue')]
    header += [f'element face {len(f)}', 'property list uchar int vertex_indices', 'end_header', '']
    path.write_bytes('\n'.join(header).encode() + vertices.tobytes() + faces.tobytes())


def make_scene(name, seed, out, kept=None):
    """Makes the scene of a preset and a seed in a folder, and gives what is worth saying of it."""
    preset = dict(apart=False, area_threshold=1e-4) | PRESETS[name]
    stones = settled_stones(name, preset, seed, kept)
    rng = np.random.default_rng([seed, 78])
    sand = Sand(preset, rng)
    stone_mesh = stones_in_window(stones, preset)
    v, f = survey(stone_mesh, sand, preset, rng)
    mesh = clean(v, f, TrueSurface(stone_mesh, sand, TOLERANCE * preset['voxel']))
    v, f, strict, best, best_of_vertex = mesh
    out.mkdir(parents=True, exist_ok=True)
    write_mesh(out / 'mesh.ply', v, f, best_of_vertex, len(stones))
    np.savez_compressed(out / 'truth.npz', tri_id=best, vert_id=best_of_vertex, tri_strict=strict)
    rows = write_table(out / 'truth.csv', stones, mesh, preset['half'], preset['area_threshold'])
    areas = triangle_areas(v, f)
    facts = dict(preset=name, seed=seed, voxel_mm=1e3 * preset['voxel'], area_threshold=preset['area_threshold'],
                 vertices=len(v), triangles=len(f), surface_area=areas.sum(), mean_triangle_area=areas.mean(),
                 pebbles=len(stones), visible=sum(row[2] for row in rows))
    (out / 'meta.json').write_text(json.dumps(facts, indent=1))
    return facts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('preset', choices=PRESETS, help='kind of bed')
    parser.add_argument('seed', type=int, help='names the scene: other seeds, other stones')
    parser.add_argument('out', type=Path, help='folder for the scene, made if missing')
    parser.add_argument('--settled', type=Path, metavar='FILE', help='where settled stones are kept, to make only the survey anew')
    asked = parser.parse_args()
    facts = make_scene(asked.preset, asked.seed, asked.out, asked.settled)
    print('{out}: {triangles} triangles, {visible} visible stones'.format(out=asked.out, **facts))


if __name__ == '__main__':
    main()
