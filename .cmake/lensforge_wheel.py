# SPDX-License-Identifier: GPL-3.0-or-later
"""Wheels of lensforge: the build backend that pyproject.toml names (PEP 517), and the packing itself (PEP 427).

lensforge_wheel.py FOLDER VERSION OUT: packs the package in FOLDER as a wheel for this Python and glibc."""
import base64
import hashlib
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tomllib
import zipfile

METADATA = """Metadata-Version: 2.1
Name: {name}
Version: {version}
Summary: {description}
License: {license[text]}
Requires-Python: =={python}.*
"""
WHEEL = """Wheel-Version: 1.0
Generator: lensforge
Root-Is-Purelib: false
Tag: {tag}
"""
CHECKOUT = pathlib.Path(__file__).resolve().parent.parent
DEBIANS_PYTHON = "/usr/bin/python3"


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """@return the wheel's file name."""
    ours, = subprocess.run([DEBIANS_PYTHON, "-c", "import sys; print(sys.version_info[:2])"], check=True, text=True,
                           capture_output=True).stdout.splitlines()
    if ours != str(sys.version_info[:2]):
        sys.exit(f"Python {platform.python_version()}: the module is built for {DEBIANS_PYTHON}, {ours}; use that one")
    subprocess.run(["./bootstrap", "wheel"], cwd=CHECKOUT, check=True)
    built = max((CHECKOUT / "build/wheel").glob("*.whl"), key=os.path.getmtime)
    shutil.copy(built, wheel_directory)
    return built.name


def build_sdist(sdist_directory, config_settings=None):
    sys.exit("lensforge has no source distribution for pip; clone its repository, where `pip install .` works")


def pack(folder: pathlib.Path, version: str, out: pathlib.Path) -> pathlib.Path:
    project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    python = "{}.{}".format(*sys.version_info)
    abi = "cp" + python.replace(".", "")
    glibc = os.confstr("CS_GNU_LIBC_VERSION").split()[1].replace(".", "_")
    tag = f"{abi}-{abi}-manylinux_{glibc}_{platform.machine()}"
    files = {path.relative_to(folder).as_posix(): path.read_bytes()
             for path in sorted(folder.rglob("*")) if path.is_file()}
    about = f"{project['name']}-{version}.dist-info"
    needs = "".join(f"Requires-Dist: {one}\n" for one in project["dependencies"])
    files[f"{about}/METADATA"] = (METADATA.format(**project, version=version, python=python) + needs).encode()
    files[f"{about}/WHEEL"] = WHEEL.format(tag=tag).encode()
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        record += f"{name},sha256={digest},{len(data)}\n"
    files[f"{about}/RECORD"] = f"{record}{about}/RECORD,,\n".encode()
    wheel = out / f"{project['name']}-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED, 9)
    return wheel


if __name__ == "__main__":
    print(pack(pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])))
