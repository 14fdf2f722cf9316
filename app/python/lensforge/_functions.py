# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands as functions: the same options and the same work; what a command prints is returned."""

import json
import os
import pathlib
import tempfile
import typing

import numpy as np

from . import _lensforge
from ._errors import InputError
from ._lens import Lens, path_of, with_options
from ._progress import function_of

# Modes of PIL's pictures whose arrays hold light or encoded light; others are converted.
_PLAIN_MODES = ("1", "L", "LA", "RGB", "RGBA", "I;16", "I;16L", "I;16B", "F")


def _picture(picture):
    """A path as text, or an array of a picture's numbers."""
    if isinstance(picture, (str, bytes, os.PathLike)):
        return path_of(picture)
    mode = getattr(picture, "mode", None)
    if isinstance(mode, str) and mode not in _PLAIN_MODES and hasattr(picture, "convert"):
        picture = picture.convert("RGBA")
    array = np.asarray(picture)
    if array.dtype == object or array.ndim == 0:
        raise TypeError(f"picture={picture!r}: must be a path, an array or a PIL picture")
    return array * np.uint8(255) if array.dtype == bool else array


def _folder(lens):
    """The folder of a Lens or a path. Raises InputError if the lens has none yet."""
    if not isinstance(lens, Lens):
        return path_of(lens)
    if lens.folder is None:
        raise InputError("the lens is in no folder yet; save() it first")
    return path_of(lens.folder)


@with_options("design")
def design(picture, *, progress=None, **options):
    """Shapes a lens that projects a picture, and returns it as a Lens.

    picture: the path of a file; or an array (H, W) or (H, W, C), or what numpy.asarray() makes one
    of, such as a PIL picture. C is 1 (grey), 2 (grey, alpha), 3 (RGB) or 4 (RGB, alpha). Numbers
    mean what they mean in files: floats are linear light, 1 is white; uint8 and uint16 are
    sRGB-encoded, 255 or 65535 is white; of booleans True is white. RGB becomes its luminance
    (Rec. 709) in linear light. Where alpha is below its largest value, `background` shows through.
    progress: a function of stage, done and total, called at most ten times a second; what it raises
    stops the work and reaches the caller. total is 0 where it is unknown. True shows a bar by tqdm
    if there is one, else lines on stderr.
    Raises InputError, RunError. The options are those of lensforge design:
    """
    with function_of(progress) as told:
        return Lens._of(_lensforge.design(_picture(picture), options, told))


class ThreeLenses(typing.NamedTuple):
    """Lenses for a red, a green and a blue lamp, and what they project together."""

    red: Lens
    green: Lens
    blue: Lens
    color: dict
    """As `color` in color.json: "lamps", "delta_e" (CIEDE2000), "outside", "registration_…"."""


@with_options("three_lamps")
def three_lamps(picture, *, progress=None, **options):
    """Shapes three lenses, each for a lamp of one wavelength, that project a picture in colour.

    picture, progress: as in design(), but RGB stays colour. The lenses stand side by side from left
    to right, lamp_gap apart, and their pictures add up at one place. Returns a ThreeLenses: `red`,
    `green`, `blue`, each a Lens, and `color`, a dict of the lamps' shares of the power, the
    differences in colour and what faults of registration do to them.
    Raises InputError, RunError. The options are those of lensforge design for three lamps:
    """
    with function_of(progress) as told:
        *lenses, color = _lensforge.three_lamps(_picture(picture), options, told)
        return ThreeLenses(*map(Lens._of, lenses), color)


@with_options("render")
def render(lens, **options):
    """What a Lens, or the one in a folder, projects.

    Returns (H, W) float32, linear light, 1 is the target's white. The options are those of
    lensforge render:
    """
    lens = lens if isinstance(lens, Lens) else Lens(lens)
    return _lensforge.render(lens._held, options)


@with_options("cam")
def cam(lens, *, progress=None, **options):
    """Makes the programs that mill a lens, the milled surface and a report, in the folder's cam/.

    With face="front" those of its front, in cam-front/.

    lens: a saved Lens or a lens folder's path; progress: as in design(). Returns a dict of "files",
    "warnings" and "report", as report.json has it. The options are those of lensforge cam:
    """
    with function_of(progress) as told:
        return _lensforge.cam(_folder(lens), options, told)


@with_options("export")
def export(lens, out, *, progress=None, **options):
    """Writes a lens as a solid, mesh or height map.

    lens: a saved Lens or a lens folder's path; out: the file, its ending says the format; progress:
    as in design(). Returns a dict of what was written. The options are those of lensforge export:
    """
    with function_of(progress) as told:
        return _lensforge.export(_folder(lens), path_of(out), options, told)


@with_options("plan")
def plan(picture, *, progress=None, **options):
    """Proposes sizes for a lens from what is known of picture, lamp, wall and workshop.

    picture: a path; progress: as in design(). Returns a dict with "proposals", each with sizes, what
    to expect, and the commands that make it. The options are those of lensforge plan:
    """
    with function_of(progress) as told:
        return _lensforge.plan({"PICTURE": path_of(picture)}, options, told)


@with_options("view")
def view(lens, out, *, progress=None, **options):
    """Writes a page that draws a lens's light and lets one change it.

    lens: a saved Lens or a lens folder's path; out: the page, .html; progress: as in design().
    Returns a dict: "source", "out", "bytes" and "surfaces". The options are those of lensforge view:
    """
    with function_of(progress) as told:
        return _lensforge.view({"DIR": _folder(lens), "--out": path_of(out)}, options, told)


@with_options("nest")
def nest(lenses, out, *, progress=None, **options):
    """Makes programs that mill several lenses of one blank with one zero.

    lenses: saved Lenses or lens folders' paths, one named twice is cut twice; out: the folder to
    write; progress: as in design(). Returns a dict with "files", "warnings", "lenses" and what else
    nest.json has. The options are those of lensforge nest; blank must be given:
    """
    if isinstance(lenses, (Lens, str, bytes, os.PathLike)):
        raise TypeError(f"lenses={lenses!r}: must be a list of lenses or folders")
    given = {"DIR": [_folder(lens) for lens in lenses], "--out": path_of(out)}
    with function_of(progress) as told:
        return _lensforge.nest(given, options, told)


@with_options("coupon")
def coupon(out, *, progress=None, **options):
    """Makes a test piece that calibrates a workshop, or with fit= fits the workshop to it.

    out: the folder to write, or the fitted workshop's file; progress: as in design(). Returns a
    dict: "files", and what the readings will tell ("expected") or tell ("fit"). The options are
    those of lensforge coupon:
    """
    with function_of(progress) as told:
        return _lensforge.coupon({"--out": path_of(out)}, options, told)


@with_options("check")
def check(lens=None, photos=(), out=None, *, progress=None, **options):
    """Finds a lens's picture in a photograph of the wall and says what went wrong.

    lens: a saved Lens or a lens folder's path; photos: a path, or paths of several exposures; out:
    the folder to write; progress: as in design(). Returns a dict with "verdict", "causes" and what
    else check.json has. None of these three is needed with chart=, which writes a chart for the
    wall and returns its "files". With lamp_from= photos is empty, lens may be None (a pinhole), and
    the dict has "lamp" and "next". The options are those of lensforge check:
    """
    if isinstance(photos, (str, bytes, os.PathLike)):
        photos = [photos]
    given = {"PHOTO": [path_of(photo) for photo in photos]} if photos else {}
    if lens is not None:
        given["LENS"] = _folder(lens)
    if out is not None:
        given["--out"] = path_of(out)
    with function_of(progress) as told:
        return _lensforge.check(given, options, told)


@with_options("reflect")
def reflect(mesh, out=None, *, progress=None, **options):
    """Deforms a mesh so that it reflects light as wanted.

    mesh: the file of a shape or solid; out: the folder to write, not needed with evaluate=True;
    progress: as in design(). Returns a dict of energies, displacements and "files". The options are
    those of lensforge reflect:
    """
    given = {"MESH": path_of(mesh)}
    if out is not None:
        given["--out"] = path_of(out)
    with function_of(progress) as told:
        return _lensforge.reflect(given, options, told)


@with_options("info")
def info(source, **options):
    """Says what a lens folder, solid, mesh, picture or G-code program is.

    source: a Lens that is saved, or a path. Returns a dict; "kind" says which other keys there are.
    The options are those of lensforge info:
    """
    return _lensforge.info({"SOURCE": _folder(source)}, options, None)


def _axis(option, values):
    if isinstance(values, (str, bytes)) or not hasattr(values, "__iter__"):
        values = [values]
    return f"{option}=" + ",".join(str(value) for value in values)


@with_options("batch")
def batch(jobs, out, *, grid=None, progress=None, **options):
    """Does jobs, each in a folder of its own and in a process of its own.

    jobs: dicts such as {"name": "a", "command": "design", "target": "a.png", "options": {"focal":
    250}, "then": ["cam"]}, or the path of a file of JSON lines; out: where every job gets a folder
    of its name; grid: a dict such as {"focal": [250, 300]}: every job with every combination of the
    values; progress: as in design(), done and total count the jobs. Returns a dict: "out", and
    "jobs" with every job's "status" and "message"; a job that fails raises nothing. The options are
    those of lensforge batch:
    """
    axes = [_axis(option, values) for option, values in (grid or {}).items()]
    with tempfile.TemporaryDirectory() as place, function_of(progress) as told:
        if not isinstance(jobs, (str, bytes, os.PathLike)):
            file = pathlib.Path(place) / "jobs"
            file.write_text("".join(json.dumps(job, default=os.fspath) + "\n" for job in jobs))
            jobs = file
        given = {"JOBS": path_of(jobs), "--out": path_of(out)}
        if axes:
            given["--grid"] = axes
        return _lensforge.batch(given, options, told)
