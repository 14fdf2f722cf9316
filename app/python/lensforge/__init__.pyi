# SPDX-License-Identifier: GPL-3.0-or-later
"""Types of the module; help(lensforge.design) and its like list the options."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Union

import numpy as np
import numpy.typing as npt

class _Picture(Protocol):
    """A picture of PIL, or anything else of which numpy makes an array."""

    @property
    def __array_interface__(self) -> dict[str, Any]: ...

_Path = Union[str, "os.PathLike[str]"]
_Option = Union[bool, int, float, _Path, Sequence[float]]
_Linear = npt.NDArray[np.float32]
_Progress = Union[None, bool, Callable[[str, float, float], object]]

__version__: str

class InputError(ValueError):
    """Bad input: names the keyword, array or file, its value and the rule that it broke."""

class RunError(RuntimeError):
    """Something outside of the program failed while it ran: a full disk, a lost file."""

class MissingFileError(FileNotFoundError, InputError):
    """A file or folder that is to be read does not exist; an InputError, too."""

class Setup:
    """Everything between the lamp and the wall but the surface."""

    def __init__(self, columns: int, rows: int, **options: _Option) -> None: ...
    @property
    def pixels(self) -> tuple[int, int]: ...
    @property
    def lens_size(self) -> tuple[float, float]: ...
    @property
    def image_size(self) -> tuple[float, float]: ...
    @property
    def focal_length(self) -> float: ...
    def to_dict(self) -> dict[str, Any]: ...

class Lens:
    """A designed lens: what design() returns, or what a lens folder holds."""

    def __init__(self, folder: _Path) -> None: ...
    @property
    def vertices(self) -> npt.NDArray[np.float64]: ...
    @property
    def faces(self) -> npt.NDArray[np.int32]: ...
    @property
    def target(self) -> _Linear: ...
    @property
    def projected(self) -> _Linear: ...
    @property
    def second_target(self) -> _Linear | None: ...
    @property
    def second_projected(self) -> _Linear | None: ...
    @property
    def setup(self) -> Setup: ...
    @property
    def model(self) -> str: ...
    @property
    def metrics(self) -> dict[str, dict[str, float]]: ...
    @property
    def provenance(self) -> dict[str, Any]: ...
    @property
    def folder(self) -> Path | None: ...
    def save(self, folder: _Path, force: bool = False) -> None: ...
    def _repr_png_(self) -> bytes: ...

class ThreeLenses(NamedTuple):
    """Lenses for a red, a green and a blue lamp, and what they project together."""

    red: Lens
    green: Lens
    blue: Lens
    color: dict[str, Any]

def design(
    picture: _Path | _Picture | npt.ArrayLike, *, progress: _Progress = None, **options: _Option
) -> Lens: ...
def three_lamps(
    picture: _Path | _Picture | npt.ArrayLike, *, progress: _Progress = None, **options: _Option
) -> ThreeLenses: ...
def render(lens: Lens | _Path, **options: _Option) -> _Linear: ...
def cam(lens: Lens | _Path, *, progress: _Progress = None, **options: _Option) -> dict[str, Any]: ...
def export(
    lens: Lens | _Path, out: _Path, *, progress: _Progress = None, **options: _Option
) -> dict[str, Any]: ...
def plan(picture: _Path, *, progress: _Progress = None, **options: _Option) -> dict[str, Any]: ...
def view(
    lens: Lens | _Path, out: _Path, *, progress: _Progress = None, **options: _Option
) -> dict[str, Any]: ...
def nest(
    lenses: Iterable[Lens | _Path], out: _Path, *, progress: _Progress = None, **options: _Option
) -> dict[str, Any]: ...
def coupon(out: _Path, *, progress: _Progress = None, **options: _Option) -> dict[str, Any]: ...
def check(
    lens: Lens | _Path | None = None,
    photos: _Path | Iterable[_Path] = (),
    out: _Path | None = None,
    *,
    progress: _Progress = None,
    **options: _Option,
) -> dict[str, Any]: ...
def reflect(
    mesh: _Path, out: _Path | None = None, *, progress: _Progress = None, **options: _Option
) -> dict[str, Any]: ...
def info(source: Lens | _Path, **options: _Option) -> dict[str, Any]: ...
def batch(
    jobs: _Path | Iterable[Mapping[str, Any]],
    out: _Path,
    *,
    grid: Mapping[str, Any] | None = None,
    progress: _Progress = None,
    **options: _Option,
) -> dict[str, Any]: ...
def flux_image(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    setup: Setup,
    model: str = "smooth",
    threads: int = 0,
) -> npt.NDArray[np.float64]: ...
def flux_image_vjp(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    setup: Setup,
    cotangent: npt.ArrayLike,
    model: str = "smooth",
    threads: int = 0,
) -> npt.NDArray[np.float64]: ...
