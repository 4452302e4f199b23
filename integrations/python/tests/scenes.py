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


def rotations(rng, count):
    """Random rotations of shape (count, 3, 3)."""
    q, r = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    q = q * np.sign(np.diagonal(r, axis1=1, axis2=2))[:, None, :]
    return q * np.linalg.det(q)[:, None, None]


def poses(seed, count, spread):
    """Random poses of shape (count, 4, 4)."""
    rng = np.random.default_rng(seed)
    return nearmiss.pose(rotations(rng, count), rng.normal(size=(count, 3)) * spread)
