"""Pictures of contacts and clearances, with matplotlib."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._native import Answer, AnyScan, Distance
from ._poses import matrices

#: Points drawn of each scan.
MOST = 20_000


def _pyplot() -> Any:
    try:
        return import_module("matplotlib.pyplot")
    except ImportError as cause:
        raise ImportError("expected matplotlib, got none; `pip install nearmiss[plot]`") from cause


def _placed(scan: AnyScan, pose: Any) -> NDArray[np.float64]:
    points = scan.points[:: max(1, len(scan) // MOST)]
    matrix = np.eye(4) if pose is None else matrices(pose)
    placed: NDArray[np.float64] = points @ matrix[:3, :3].T + matrix[:3, 3]
    return placed


def contact(
    a: AnyScan,
    b: AnyScan,
    pose: Any = None,
    own_pose: Any = None,
    *,
    answer: Answer | Distance | None = None,
    axes: Any = None,
) -> Any:
    """Draw two scans, ``b`` at ``pose`` and ``a`` at ``own_pose``, and return the axes.

    A red dot marks the place where they touch; a red line joins their nearest points otherwise. Both
    come from ``answer``, which is asked for if it is missing.
    """
    pyplot = _pyplot()
    if axes is None:
        axes = pyplot.figure().add_subplot(projection="3d")
    if answer is None:
        answer = a.collide(b, pose, own_pose)
        if not answer.touches:
            answer = a.distance(b, pose, own_pose)
    for scan, placed, colour in ((a, own_pose, "tab:blue"), (b, pose, "tab:orange")):
        points = _placed(scan, placed)
        size = min(4.0, max(0.5, 2e4 / len(points)))
        axes.scatter(*points.T, s=size, color=colour, alpha=0.6, linewidths=0)
    if isinstance(answer, Answer):
        if answer.witness is not None:
            axes.scatter(*answer.witness, color="red", s=40)
            axes.set_title("touching")
    elif answer.point_a is not None and answer.point_b is not None:
        axes.plot(*np.transpose([answer.point_a, answer.point_b]), color="red", marker=".")
        axes.set_title(f"{answer.lower:.4g} to {answer.upper:.4g} apart")
    axes.set_aspect("equal")
    return axes


def clearance(distances: NDArray[Any], times: ArrayLike | None = None, *, axes: Any = None) -> Any:
    """Draw the bounds of distances along a path, as ``Scan.distance_each`` returns them."""
    pyplot = _pyplot()
    if axes is None:
        axes = pyplot.figure().add_subplot()
    at = np.arange(len(distances)) if times is None else np.asarray(times)
    axes.fill_between(at, distances["lower"], distances["upper"], alpha=0.3, label="between both bounds")
    axes.plot(at, distances["upper"], label="nearest points")
    axes.set_xlabel("pose" if times is None else "time")
    axes.set_ylabel("distance")
    axes.set_ylim(bottom=0)
    axes.legend()
    return axes
