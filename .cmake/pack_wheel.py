# SPDX-License-Identifier: GPL-3.0-or-later
"""pack_wheel.py FOLDER VERSION OUT: packs the package in FOLDER as a wheel for this Python and glibc (PEP 427)."""
import base64
import hashlib
import os
import pathlib
import platform
import sys
import zipfile

METADATA = """Metadata-Version: 2.1
Name: lensforge
Version: {version}
Summary: From a picture to the milled lens that projects it
License: GPL-3.0-or-later
Requires-Python: =={python}.*
Requires-Dist: numpy
"""
WHEEL = """Wheel-Version: 1.0
Generator: lensforge
Root-Is-Purelib: false
Tag: {tag}
"""


def main() -> None:
    folder, version, out = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])
    major, minor = sys.version_info[:2]
    glibc = os.confstr("CS_GNU_LIBC_VERSION").split()[1].replace(".", "_")
    tag = f"cp{major}{minor}-cp{major}{minor}-manylinux_{glibc}_{platform.machine()}"
    files = {path.relative_to(folder).as_posix(): path.read_bytes()
             for path in sorted(folder.rglob("*")) if path.is_file()}
    about = f"lensforge-{version}.dist-info"
    files[f"{about}/METADATA"] = METADATA.format(version=version, python=f"{major}.{minor}").encode()
    files[f"{about}/WHEEL"] = WHEEL.format(tag=tag).encode()
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        record += f"{name},sha256={digest},{len(data)}\n"
    files[f"{about}/RECORD"] = f"{record}{about}/RECORD,,\n".encode()
    wheel = out / f"lensforge-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED, 9)
    print(wheel)


main()
