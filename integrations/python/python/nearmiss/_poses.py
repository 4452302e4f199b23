"""Poses from rotations and translations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def pose(rotation: Any = None, translation: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the pose that rotates first, and then translates: shape (4, 4), or (N, 4, 4).

    ``rotation`` is an array of shape (3, 3) or (N, 3, 3), or an object with ``as_matrix()``, such as
    a ``scipy.spatial.transform.Rotation``; by default none. ``translation`` has shape (3,) or (N, 3);
    by default zero. One of them may be single and the other many.
    """
    turn = np.asarray(_matrix(np.eye(3) if rotation is None else rotation), dtype=np.float64)
    shift = np.asarray(np.zeros(3) if translation is None else translation, dtype=np.float64)
    if turn.ndim not in (2, 3) or turn.shape[-2:] != (3, 3):
        raise ValueError(f"expected a rotation of shape (3, 3) or (N, 3, 3), got {turn.shape}")
    if shift.ndim not in (1, 2) or shift.shape[-1] != 3:
        raise ValueError(f"expected a translation of shape (3,) or (N, 3), got {shift.shape}")
    try:
        outer = np.broadcast_shapes(turn.shape[:-2], shift.shape[:-1])
    except ValueError:
        counts = f"{turn.shape[0]} and {shift.shape[0]}"
        raise ValueError(f"expected as many rotations as translations, got {counts}") from None
    matrix = np.zeros((*outer, 4, 4))
    matrix[..., :3, :3] = turn
    matrix[..., :3, 3] = shift
    matrix[..., 3, 3] = 1.0
    return matrix


def matrices(given: Any) -> NDArray[np.float64]:
    """Return anything that is accepted as a pose as an array of shape (4, 4) or (N, 4, 4)."""
    if isinstance(given, tuple) and len(given) == 2:
        return pose(*given)
    array = np.asarray(_matrix(given))
    if array.dtype.kind not in "fiu":
        raise ValueError(
            "expected a pose of shape (4, 4), poses of shape (N, 4, 4), a rotation with as_matrix(), "
            f"or a pair (rotation, translation), got {type(given).__name__}"
        )
    if array.ndim in (2, 3) and array.shape[-2:] == (3, 3):
        return pose(array)
    return np.ascontiguousarray(array, dtype=np.float64)


def _matrix(given: Any) -> Any:
    return given.as_matrix() if hasattr(given, "as_matrix") else given
