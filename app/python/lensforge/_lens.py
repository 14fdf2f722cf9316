# SPDX-License-Identifier: GPL-3.0-or-later
"""Lenses and setups, and the pictures of meshes under them."""

import inspect
import operator
import os
import pathlib
import tempfile

import numpy as np

from . import _lensforge

_MAX = 2**31 - 1


def path_of(path):
    """A path as text. Raises TypeError for what is no path."""
    return os.fsdecode(path)


def whole(name, value):
    """A whole number in the library's range. Raises TypeError for what is none."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}={value!r}: must be a whole number") from None
    return max(-_MAX, min(_MAX, number))


def with_options(name):
    """Adds the options of a function or class to its docstring."""

    def described(function):
        text = inspect.cleandoc(function.__doc__)
        function.__doc__ = f"{text}\n" + getattr(_lensforge, f"{name}_options")
        return function

    return described


@with_options("setup")
class Setup:
    """Everything between the lamp and the wall but the surface. It does not change.

    Setup(columns, rows, **options): light, lens and screen for a picture of so many pixels. Setups
    can be compared, pickled and copied. The options are those of lensforge design:
    """

    __slots__ = ("_held", "__weakref__")

    def __init__(self, columns, rows, **options):
        self._held = _lensforge.make_setup(whole("columns", columns), whole("rows", rows), options)

    @classmethod
    def _of(cls, held):
        setup = cls.__new__(cls)
        setup._held = held
        return setup

    @property
    def pixels(self):
        """(columns, rows) of the picture."""
        return self._held.pixels

    @property
    def lens_size(self):
        """(width, height) of the lens, mm."""
        return self._held.lens_size

    @property
    def image_size(self):
        """(width, height) of the picture on the screen, mm."""
        return self._held.image_size

    @property
    def focal_length(self):
        """z of the picture's centre, mm in the lens frame."""
        return self._held.focal_length

    def to_dict(self):
        """All of it, as lens.json has it."""
        return self._held.to_dict()

    def __eq__(self, other):
        return self._held.equals(other._held) if isinstance(other, Setup) else NotImplemented

    def __hash__(self):
        return hash((self.pixels, self.lens_size, self.image_size, self.focal_length))

    def __reduce__(self):
        return _setup_from, self._held.state()

    def __deepcopy__(self, memo):
        return self  # It does not change.

    def __repr__(self):
        return repr(self._held)


def _setup_from(text, heights):
    return Setup._of(_lensforge.setup_of(text, heights))


class Lens:
    """A designed lens: what design() returns, or what a lens folder holds. It does not change.

    Lens(folder) reads a lens folder. Lenses of the same setup, surface and pictures are equal. A
    pickled lens comes back as one that is read from its folder, without the course of its design.
    """

    __slots__ = ("_held", "__weakref__")

    def __init__(self, folder):
        self._held = _lensforge.read_lens(path_of(folder))

    @classmethod
    def _of(cls, held):
        lens = cls.__new__(cls)
        lens._held = held
        return lens

    @property
    def vertices(self):
        """(V, 3) float64: the optical surface, mm in the lens frame; a read-only view."""
        return self._held.vertices

    @property
    def faces(self):
        """(F, 3) int32: vertex numbers, counter-clockwise seen from +z; a read-only view."""
        return self._held.faces

    @property
    def target(self):
        """(H, W) float32: the wanted picture, linear light, 1 is white; a read-only view."""
        return self._held.target

    @property
    def projected(self):
        """(H, W) float32: the picture that the lens projects, as target; a read-only view."""
        return self._held.projected

    @property
    def second_target(self):
        """As target, the picture wanted on a second screen; None without one."""
        return self._held.second_target

    @property
    def second_projected(self):
        """As projected, the picture on a second screen; None without one."""
        return self._held.second_projected

    @property
    def setup(self):
        """Setup: light, screen and picture."""
        return Setup._of(self._held.setup)

    @property
    def model(self):
        """str: the surface model that it was designed with."""
        return self._held.model

    @property
    def metrics(self):
        """dict: for every surface model how close its picture is to the target."""
        return self._held.metrics

    @property
    def provenance(self):
        """dict: the program, options and outcome that the lens comes from."""
        return self._held.provenance

    @property
    def folder(self):
        """pathlib.Path where the lens lies, None until it is saved."""
        return self._held.folder

    def save(self, folder, force=False):
        """Writes the lens folder, as the design command does; force replaces an earlier lens."""
        self._held.save(path_of(folder), bool(force))

    def __eq__(self, other):
        return self._held.equals(other._held) if isinstance(other, Lens) else NotImplemented

    def __hash__(self):
        return hash((self.setup, self.model, len(self.faces), float(self.vertices[:, 2].sum())))

    def __reduce__(self):
        with tempfile.TemporaryDirectory() as place:
            self._held.write(place)
            files = {file.name: file.read_bytes() for file in pathlib.Path(place).iterdir()
                     if file.suffix != ".png"}
        return _lens_from, (files, self.folder)

    def __copy__(self):
        return Lens._of(self._held.copy())

    def __deepcopy__(self, memo):
        return Lens._of(self._held.copy())

    def _repr_png_(self):
        return self._held.png()

    def __repr__(self):
        return repr(self._held)


def _lens_from(files, folder):
    with tempfile.TemporaryDirectory() as place:
        for name, content in files.items():
            (pathlib.Path(place) / name).write_bytes(content)
        lens = Lens(place)
    lens._held.folder = "" if folder is None else folder
    return lens


def _mesh(function, vertices, faces, setup):
    if not isinstance(setup, Setup):
        raise TypeError(f"{function}(): setup={setup!r}: must be a Setup")
    return np.asarray(vertices), np.asarray(faces), setup._held


def flux_image(vertices, faces, setup, model="smooth", threads=0):
    """The flux that a mesh sends to every pixel, as shares of what the lens takes.

    vertices: (V, 3) floats, mm in the lens frame; faces: (F, 3) integers, counter-clockwise seen
    from +z; model: "smooth", normals at the vertices, or "facet"; threads: 0 for all.
    Returns (H, W) float64, row 0 on top; the sum is the share that lands in the picture.
    Raises InputError for arrays of another shape, or a screen that is not beyond the surface.
    """
    mesh = _mesh("flux_image", vertices, faces, setup)
    return _lensforge.flux_image(*mesh, str(model), whole("threads", threads))


def flux_image_vjp(vertices, faces, setup, cotangent, model="smooth", threads=0):
    """The vector-Jacobian product of flux_image().

    cotangent: (H, W), derivatives of a scalar by flux_image()'s pixels.
    Returns (V, 3) float64, derivatives of that scalar by the vertices, per mm.
    Raises InputError as flux_image() does, and for a setup with an outline.
    """
    mesh = _mesh("flux_image_vjp", vertices, faces, setup)
    return _lensforge.flux_image_vjp(*mesh, np.asarray(cotangent), str(model),
                                     whole("threads", threads))
