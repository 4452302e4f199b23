"""Scans and poses that several tests use."""

import os
from functools import cache
from pathlib import Path

import numpy as np

import nearmiss

DATA = Path(__file__).resolve().parents[3] / "testdata" / "data"
DRAGON = DATA / "dragon-5k.ply"

#: The command line, if it was built.
COMMAND = os.environ.get("NEARMISS_COMMAND", "")


@cache
def dragon():
    """A real scan of 5,205 points, 0.2 long."""
    return nearmiss.Scan.read(DRAGON)


def plate(side=1.0, count=50):
    """Points of a square at z = 0, from 0 to `side`."""
    axis = np.arange(count) * (side / count)
    x, y = np.meshgrid(axis, axis, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)


def room():
    """A room of 6 by 4, with a step of 0.2 across the middle."""
    x, y = np.meshgrid(np.arange(0, 6.001, 0.04), np.arange(0, 4.001, 0.04), indexing="ij")
    floor = np.stack([x.ravel(), y.ravel(), np.where(x < 3, 0.0, 0.2).ravel()], axis=1)
    walls = []
    for h in np.arange(0, 2.6, 0.04):
        across, along = np.arange(0, 6.001, 0.04), np.arange(0, 4.001, 0.04)
        for y in (0.0, 4.0):
            walls.append(np.stack([across, np.full_like(across, y), np.full_like(across, h)], axis=1))
        for x in (0.0, 6.0):
            walls.append(np.stack([np.full_like(along, x), along, np.full_like(along, h)], axis=1))
    return np.concatenate([floor, *walls])


def depth_frame(time, height=48, width=64):
    """A camera looks at a wall, two units away and nearer as time goes by. Returns (height, width, 3)."""
    v, u = np.meshgrid(np.arange(height) - height / 2, np.arange(width) - width / 2, indexing="ij")
    depth = 2.0 - 0.1 * time
    frame = np.stack([u * depth / 60, v * depth / 60, np.full_like(u, depth)], axis=-1)
    frame[5, 3] = np.nan
    frame[7, 9] = 0.0
    return frame


def rotations(rng, count):
    """Random rotations of shape (count, 3, 3)."""
    q, r = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q = q * np.sign(np.diagonal(r, axis1=1, axis2=2))[:, None, :]
    return q * np.linalg.det(q)[:, None, None]


def poses(seed, count, spread):
    """Random poses of shape (count, 4, 4)."""
    rng = np.random.default_rng(seed)
    return nearmiss.pose(rotations(rng, count), rng.normal(size=(count, 3)) * spread)
