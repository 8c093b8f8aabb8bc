# SPDX-License-Identifier: GPL-2.0-or-later
"""`pip install .` without network: CMake builds the module, and this makes the wheel (PEP 517). It needs no package."""

import base64
import hashlib
import os
import pathlib
import re
import shutil
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


def _cmake(*words):
    try:
        code = subprocess.run(["cmake", *map(str, words)], check=False).returncode
    except FileNotFoundError:
        code = "there is no cmake"
    if code != 0:
        sys.exit(f"lobatto: the module could not be built (cmake {words[0]}: {code}). The lines above say why. What it "
                 "needs is listed under \"Install\" in docs/python.md and at the top of the file `lobatto`.")


def _build():
    """The files of the package: {name in the wheel: path}."""
    cache = BUILD / "CMakeCache.txt"
    if cache.exists() and f"CMAKE_HOME_DIRECTORY:INTERNAL={ROOT}\n" not in cache.read_text():
        shutil.rmtree(BUILD)  # of a tree that was moved or copied
    _cmake("-S", ROOT, "-B", BUILD, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DLOBATTO_PYTHON=ON",
           f"-DPython_EXECUTABLE={sys.executable}", "-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON")
    _cmake("--build", BUILD, "--target", "python_sources", "--parallel", os.cpu_count())
    files = [path for path in sorted((ROOT / "python" / "lobatto").iterdir()) if path.is_file()]
    # Of this Python: another one may have built its module in the same folder.
    files.append(BUILD / "python" / "lobatto" / f"_lobatto{sysconfig.get_config_var('EXT_SUFFIX')}")
    files.append(BUILD / "library" / "liblobatto.so.0")
    return {f"lobatto/{path.name}": path for path in files}


def _info():
    """The files that say what the wheel is: {name in the wheel: content}."""
    folder = f"lobatto-{_version()}.dist-info"
    wheel = f"Wheel-Version: 1.0\nGenerator: lobatto\nRoot-Is-Purelib: false\nTag: {_tag()}\n"
    return {f"{folder}/METADATA": _metadata().encode(), f"{folder}/WHEEL": wheel.encode()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Without it pip builds the wheel twice, the first time only to read its name."""
    for name, content in _info().items():
        path = pathlib.Path(metadata_directory) / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    return path.parent.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    contents = {name: path.read_bytes() for name, path in _build().items()}
    contents.update(_info())
    record = ""
    for name, content in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    own = f"lobatto-{_version()}.dist-info/RECORD"
    contents[own] = (record + f"{own},,\n").encode()
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
