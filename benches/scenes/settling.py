"""Stones fall into a walled box and come to rest (pybullet, convex hulls)."""
import sys
import time

import numpy as np
from scipy.spatial.transform import Rotation

from stones import HULL_VERTICES

# The solver is made for metres: stones of centimetres are made so much larger.
SCALE = 20.0
STEPS = 4000
# A scene that does not come to rest by then is taken as it lies, seconds.
PATIENCE_S = 200


def settle(stones, preset, rng):
    """Gives each stone its place: vertices `w`, directions of its axes `rw`, centre of mass `x`."""
    import pybullet as p

    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.81)
    p.setPhysicsEngineParameter(numSolverIterations=40, fixedTimeStep=1 / 200)
    _box(p, preset['box'] * SCALE)
    order = rng.permutation(len(stones))
    bodies = _drop(p, [stones[i] for i in order], preset, rng)
    began = time.time()
    for step in range(STEPS):
        p.stepSimulation()
        if step % 100 == 99:
            fastest = max(np.linalg.norm(p.getBaseVelocity(body)[0]) for body in bodies)
            if step > 800 and fastest < 0.02:
                break
            if time.time() - began > PATIENCE_S:
                print(f'stones still moved after {PATIENCE_S} s: a slower machine makes another scene', file=sys.stderr)
                break
    for i, body in zip(order, bodies):
        x, q = p.getBasePositionAndOrientation(body)
        turn = np.array(p.getMatrixFromQuaternion(q)).reshape(3, 3)
        stone = stones[i]
        stone['x'] = np.array(x) / SCALE
        stone['w'] = stone['v'] @ turn.T + stone['x']
        stone['rw'] = stone['rot'] @ turn.T
    p.disconnect()


def _box(p, half):
    floor = p.createCollisionShape(p.GEOM_BOX, halfExtents=[3 * half, 3 * half, 1])
    p.changeDynamics(p.createMultiBody(0, floor, basePosition=[0, 0, -1]), -1, lateralFriction=0.7)
    for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        wall = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1 if x else 3 * half, 1 if y else 3 * half, 60])
        p.createMultiBody(0, wall, basePosition=[x * (half + 1), y * (half + 1), 60])


def _drop(p, stones, preset, rng):
    """Each stone begins right above those that are there already."""
    placed, bodies = [], []
    for stone in stones:
        radius = np.linalg.norm(stone['v'], axis=1).max()
        for _ in range(400 if preset['apart'] else 1):
            xy = rng.uniform(-(preset['box'] - radius), preset['box'] - radius, 2)
            others = np.array(placed).reshape(-1, 4)
            away = np.hypot(others[:, 0] - xy[0], others[:, 1] - xy[1])
            if not (preset['apart'] and len(others) and (away < 0.8 * (others[:, 3] + radius)).any()):
                break
        z = radius
        near = away < others[:, 3] + radius
        if near.any():
            z = max(z, (others[near, 2] + np.sqrt((others[near, 3] + radius) ** 2 - away[near] ** 2)).max())
        z += 0.0005
        placed.append((*xy, z, radius))
        quat = _laid_flat(stone, rng) if preset['apart'] else rng.normal(size=4)
        quat = quat if preset['apart'] else quat / np.linalg.norm(quat)
        shape = p.createCollisionShape(p.GEOM_MESH, vertices=(stone['v'][:HULL_VERTICES] * SCALE).tolist())
        place = [at * SCALE for at in (*xy, z)]
        body = p.createMultiBody(stone['vol'] * SCALE ** 3, shape, basePosition=place, baseOrientation=quat)
        p.changeDynamics(body, -1, lateralFriction=0.6, rollingFriction=0.004, spinningFriction=0.004, restitution=0,
                         linearDamping=0.15, angularDamping=0.3)
        bodies.append(body)
    return bodies


def _laid_flat(stone, rng):
    """Its flat side down, tipped by up to some 25 degrees."""
    up = stone['rot'][2]
    yaw = rng.uniform(0, 2 * np.pi)
    flat = np.array([stone['rot'][0], np.cross(up, stone['rot'][0]), up])
    tip = rng.normal(0, 0.2, 2)[0]
    about_x = np.array([[1, 0, 0], [0, np.cos(tip), -np.sin(tip)], [0, np.sin(tip), np.cos(tip)]])
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return Rotation.from_matrix(about_z @ about_x @ flat).as_quat()
