# SPDX-License-Identifier: GPL-2.0-or-later
"""What others take of this tree: its source in a project of theirs, a wheel, a Debian package. Each is made whole, as a
user would make it, without network. That takes minutes, so it belongs to `./lobatto test --all`."""

import os
import pathlib
import shutil
import subprocess
import sys


ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ["LOBATTO_PROGRAM"])
BUILD = PROGRAM.parent


def succeed(*command, **options):
    """The standard output of a command that must succeed."""
    ran = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    assert ran.returncode == 0, f"{command}:\n{ran.stdout[-4000:]}\n{ran.stderr[-4000:]}"
    return ran.stdout


def bits_of_run(scene, folder, *words):
    """The last state of `lobatto run`: t,a,b as it writes them."""
    succeed(PROGRAM, "run", scene, *words, "--quiet", "-o", folder / "run.csv")
    return (folder / "run.csv").read_text().splitlines()[-1]


def test_a_project_that_takes_the_source_in_builds_and_installs(tmp_path):
    """By add_subdirectory; tests/library/source_test.cpp configures the other ways."""
    project, build, prefix = tmp_path / "project", tmp_path / "build", tmp_path / "prefix"
    shutil.copytree(ROOT / "examples" / "cmake", project)
    listed = (project / "CMakeLists.txt").read_text()
    found = "find_package(Lobatto 0.1 REQUIRED)"
    assert found in listed
    (project / "CMakeLists.txt").write_text(listed.replace(found, f"add_subdirectory({ROOT} lobatto)"))
    succeed("cmake", "-S", project, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release")
    succeed("cmake", "--build", build, "--parallel", os.cpu_count())
    scene = project / "arm.toml"
    assert bits_of_run(scene, tmp_path, "--points", "6").startswith(succeed(build / "kernel").strip() + ",")
    assert succeed(build / "control", scene).startswith("t = 4.00 s: a = -0.01924")
    assert "1000 of 1000" in succeed(build / "swing", scene)
    assert "Deriving" not in succeed("cmake", "--build", build)
    with scene.open("a") as file:
        file.write("# changed\n")
    assert "Deriving" in succeed("cmake", "--build", build)
    succeed("cmake", "--install", build, "--prefix", prefix)
    assert succeed(prefix / "bin" / "lobatto", "--version").startswith("lobatto 0.")


def test_pip_installs_the_module_from_the_tree_without_network(tmp_path):
    environment, home = tmp_path / "env", tmp_path / "home"
    succeed(sys.executable, "-m", "venv", "--system-site-packages", environment)
    python = environment / "bin" / "python"
    outside = {**{name: value for name, value in os.environ.items() if name != "PYTHONPATH"}, "HOME": str(home),
               "PIP_CONFIG_FILE": os.devnull}
    outside.setdefault("CCACHE_DIR", str(pathlib.Path.home() / ".cache" / "ccache"))  # another home compiles nothing anew
    # No index may be asked: neither for the module nor for what builds it.
    succeed(python, "-m", "pip", "install", "--no-index", "--no-cache-dir", ROOT, env=outside, cwd=tmp_path)
    said = succeed(python, ROOT / "examples" / "python" / "first_pendulum.py", "picture.png", env=outside, cwd=tmp_path)
    assert "measured error" in said and (tmp_path / "picture.png").stat().st_size > 5000
    where = succeed(python, "-c", "import lobatto; print(lobatto.__file__, lobatto.__version__)", env=outside,
                    cwd=tmp_path)
    assert where.startswith(str(environment)) and where.endswith(succeed(PROGRAM, "--version").removeprefix("lobatto "))
    succeed(python, "-m", "pip", "uninstall", "--yes", "lobatto", env=outside)
    assert not list(environment.glob("lib/python*/site-packages/lobatto*"))


def test_a_debian_package_holds_what_it_says_and_runs_where_it_is_unpacked(tmp_path):
    succeed("cpack", "-G", "DEB", "-B", tmp_path, cwd=BUILD)
    (package,) = tmp_path.glob("lobatto_*.deb")
    fields = succeed("dpkg-deb", "--field", package)
    for wanted in ("Package: lobatto", "Depends: g++ | clang", "libginac", "libcln", "libopenmpi",
                   "Recommends: gnuplot-nox, python3-numpy, openmpi-bin"):
        assert wanted in fields
    listed = [line.split(maxsplit=5)[5] for line in succeed("dpkg-deb", "--contents", package).splitlines()]
    assert all(name == "./" or name.startswith("./usr/") for name in listed)
    # What it does to a system beside its files: the cache of the dynamic linker.
    succeed("dpkg-deb", "--control", package, tmp_path / "control")
    scripts = {path.name: path.read_text() for path in (tmp_path / "control").iterdir()}
    assert set(scripts) == {"control", "md5sums", "postinst", "postrm"}
    assert all("ldconfig" in scripts[name] and "rm " not in scripts[name] for name in ("postinst", "postrm"))

    root = tmp_path / "root"
    succeed("dpkg-deb", "-x", package, root)
    usr = root / "usr"
    assert (usr / "share/man/man1/lobatto-run.1").exists()
    assert (usr / "share/bash-completion/completions/lobatto").exists()
    succeed(usr / "bin/lobatto", "run", usr / "share/lobatto/scenes/pendulum.toml", "--until", "1", "--quiet", "-o",
            tmp_path / "run.csv")
    assert len((tmp_path / "run.csv").read_text().splitlines()) > 20
    assert succeed(usr / "bin/lobatto-mpi", "--version") == succeed(PROGRAM, "--version")
    succeed("gcc", "-std=c99", usr / "share/lobatto/examples/cmake/swing.c", "-I", usr / "include", "-L", usr / "lib",
            "-llobatto", f"-Wl,-rpath,{usr}/lib", "-o", tmp_path / "swing")
    assert "1000 of 1000" in succeed(tmp_path / "swing", usr / "share/lobatto/examples/cmake/arm.toml")
    version = succeed(sys.executable, "-c", "import lobatto; print(lobatto.__version__)",
                      env={**os.environ, "PYTHONPATH": str(usr / "lib/python3/dist-packages")})
    assert version == succeed(PROGRAM, "--version").removeprefix("lobatto ")
