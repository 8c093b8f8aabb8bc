# SPDX-License-Identifier: GPL-2.0-or-later
"""`pip install .` without network: CMake builds the module, and this makes the wheel (PEP 517). It needs no package."""

import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "wheel"


def _version():
    return re.search(r"project\(lobatto VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def _metadata():
    return (f"Metadata-Version: 2.1\nName: lobatto\nVersion: {_version()}\n"
            "Summary: A compiler for mechanics: from a Lagrangian to its variational integrator\n"
            "License: GPL-2.0-or-later\nRequires-Python: >=3.9\nRequires-Dist: numpy\n")


def _tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _build():
    """The files of the package: {name in the wheel: path}."""
    subprocess.run(["cmake", "-S", ROOT, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DLOBATTO_PYTHON=ON",
                    f"-DPython_EXECUTABLE={sys.executable}", "-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON"], check=True)
    subprocess.run(["cmake", "--build", BUILD, "--target", "python_sources", "--parallel", str(os.cpu_count())],
                   check=True)
    files = {f"lobatto/{path.name}": path for path in sorted((BUILD / "python" / "lobatto").iterdir()) if path.is_file()}
    library = (BUILD / "library" / "liblobatto.so.0").resolve()
    files["lobatto/liblobatto.so.0"] = library
    return files


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = _build()
    info = f"lobatto-{_version()}.dist-info"
    contents = {name: path.read_bytes() for name, path in files.items()}
    contents[f"{info}/METADATA"] = _metadata().encode()
    contents[f"{info}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: lobatto\nRoot-Is-Purelib: false\n"
                                 f"Tag: {_tag()}\n").encode()
    record = ""
    for name, content in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    contents[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    wheel = f"lobatto-{_version()}-{_tag()}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    name = f"lobatto-{_version()}"
    path = pathlib.Path(sdist_directory) / f"{name}.tar.gz"
    subprocess.run(["git", "-C", ROOT, "archive", "--format=tar.gz", f"--prefix={name}/", "-o", path, "HEAD"], check=True)
    return path.name
