"""Collision, contact, clearance and distance of scanned objects, directly from their points.

Lengths and coordinates are in the units of the input. A pose maps the frame of a scan to the world:
a row-major array of shape (4, 4), or (N, 4, 4) for a batch, whose linear part is a rotation with
uniform scale; a rotation with ``as_matrix()``, as scipy has it; or a pair (rotation, translation).

    >>> import nearmiss
    >>> scan = nearmiss.read("dragon.ply")                          # or Scan(array of shape (N, 3))
    >>> scan.collide(scan, nearmiss.pose(translation=[0.24, 0, 0]))
    <Answer apart by at least 0.035..., certified>

Values that cannot be used raise ``ValueError``, arguments of a wrong kind ``TypeError``, a file that
cannot be read or written ``OSError``. Queries release the interpreter's lock, so threads run at the
same time.
"""

from __future__ import annotations

import os
from typing import Any

from ._native import (
    Answer,
    AnyScan,
    Distance,
    Hint,
    Mesh,
    MovingScan,
    Penetration,
    RayAnswer,
    Scan,
    Shape,
    ShapeAnswer,
    ShapeDistance,
    ShapeHint,
    SliceMap,
    SweepAnswer,
    Target,
    World,
    __version__,
    point_cloud2,
    read_points,
    sweep,
)
from ._poses import pose

__all__ = [
    "Answer",
    "AnyScan",
    "Distance",
    "Hint",
    "Mesh",
    "MovingScan",
    "Penetration",
    "RayAnswer",
    "Scan",
    "Shape",
    "ShapeAnswer",
    "ShapeDistance",
    "ShapeHint",
    "SliceMap",
    "SweepAnswer",
    "Target",
    "World",
    "__version__",
    "point_cloud2",
    "pose",
    "read",
    "read_points",
    "sweep",
]


def read(path: str | os.PathLike[str], **options: Any) -> Scan:
    """Return the scan of a file: opens a prepared one (``.nm``), prepares any other one.

    ``options`` are those of ``Scan.read``, or of ``Scan.open`` for a prepared file.
    """
    if os.fsdecode(path).lower().endswith(".nm"):
        return Scan.open(path, **options)
    return Scan.read(path, **options)
