"""The classes over the Rust library."""

import os
from collections.abc import Callable, Sequence
from typing import Any, Literal, SupportsIndex, TypeAlias, TypedDict, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, Unpack

_Path: TypeAlias = str | os.PathLike[str]
_Triple: TypeAlias = tuple[float, float, float] | list[float]
_Evidence: TypeAlias = Literal["certified", "estimated"]
#: A structured array of shape (N,).
_Records: TypeAlias = NDArray[np.void]
