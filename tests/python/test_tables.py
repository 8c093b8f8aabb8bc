# SPDX-License-Identifier: GPL-2.0-or-later
"""Tables of sweeps and runs, opened by the programs that people open them with."""

import json
import os
import pathlib
import subprocess

import h5py
import numpy

SCENE = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "pendulum.toml"


def lobatto(*words):
    subprocess.run([os.environ["LOBATTO_PROGRAM"], *map(str, words), "--quiet"], check=True)


def test_hdf5_has_the_columns_of_numpy_and_says_what_they_are(tmp_path):
    for name in ("a.h5", "a.npy"):
        lobatto("sweep", SCENE, "--vary", "q=0:3:50", "--vary", "points=4,6", "--until", 2, "-o", tmp_path / name)
    array = numpy.load(tmp_path / "a.npy")
    with h5py.File(tmp_path / "a.h5") as file:
        table = file["table"]
        assert table.dtype == array.dtype and table.shape == (100,)
        assert (table[:].view("u8") == array.view("u8")).all()
        assert table["points"].dtype == numpy.int64
        assert list(table.attrs["columns"]) == list(array.dtype.names)
        assert dict(zip(table.attrs["columns"], table.attrs["units"]))["q(0)"] == "rad"
        beside = json.loads((tmp_path / "a.npy.json").read_text())
        for name in ("scene", "method", "kernel", "lobatto", "scene_text"):
            assert file.attrs[name] == beside[name]
        assert file.attrs["scene_text"] == SCENE.read_text()
        assert list(file.attrs["vary"]) == ["points = 4,6", "q = 0:3:50"]


def test_a_run_as_hdf5_is_the_trajectory(tmp_path):
    for name in ("a.h5", "a.csv"):
        lobatto("run", SCENE, "--until", 2, "-o", tmp_path / name)
    rows = numpy.genfromtxt(tmp_path / "a.csv", delimiter=",", comments="#", skip_header=6)
    with h5py.File(tmp_path / "a.h5") as file:
        assert numpy.array_equal(file["table"]["q"], rows[1:, 1] if numpy.isnan(rows[0, 0]) else rows[:, 1])
        assert file.attrs["kind"] == "trajectory"


def test_starts_are_arrays_that_numpy_saved(tmp_path):
    q, omega = numpy.linspace(0, 1, 7), numpy.linspace(5, 6, 7)
    numpy.save(tmp_path / "records.npy", numpy.rec.fromarrays([q, omega], names="q,omega"))
    numpy.save(tmp_path / "states.npy", numpy.asfortranarray(numpy.column_stack([q, 0.1 * q])))
    lobatto("sweep", SCENE, "--starts", tmp_path / "records.npy", "--until", 1, "-o", tmp_path / "a.npy")
    lobatto("sweep", SCENE, "--starts", tmp_path / "states.npy", "--until", 1, "-o", tmp_path / "b.npy")
    a, b = numpy.load(tmp_path / "a.npy"), numpy.load(tmp_path / "b.npy")
    assert numpy.array_equal(a["q(0)"], q) and numpy.array_equal(a["omega"], omega)
    assert numpy.array_equal(b["q'(0)"], 0.1 * q)
    # A table is a file of starts too, once its columns are chosen.
    numpy.save(tmp_path / "again.npy", a[["q(0)", "omega"]].copy())
    lobatto("sweep", SCENE, "--starts", tmp_path / "again.npy", "--until", 1, "-o", tmp_path / "c.npy")
