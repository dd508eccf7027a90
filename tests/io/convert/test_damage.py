"""Files cut short or with bytes changed anywhere: one clear error, or a recording; nothing else."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import test_dip_imu
import test_plain_csv
import test_total_capture
import test_xio
import xsens_files
from known_motion import known
from mvnx_files import document

from mocap_jax.errors import InputError
from mocap_jax.io.convert import ReadOptions, read_source, recording_of, worn_sensors


def xsens(folder: Path) -> Path:
    return xsens_files.write(folder, known(20))


def mvnx(folder: Path) -> Path:
    (folder / "a.mvnx").write_text(document(5))
    return folder / "a.mvnx"


def xio(folder: Path) -> Path:
    test_xio.x_imu3(folder / "device", known(20))
    return folder / "device" / "Inertial.csv"


def xio_quaternion(folder: Path) -> Path:
    return xio(folder).with_name("Quaternion.csv")


def csv(folder: Path) -> Path:
    return test_plain_csv.write(folder)


def mapping(folder: Path) -> Path:
    test_plain_csv.write(folder)
    return folder / "map.toml"


def total_capture(folder: Path) -> Path:
    test_total_capture.write(folder / "a.sensors", 6)
    return folder / "a.sensors"


def dip_imu(folder: Path) -> Path:
    test_dip_imu.write(folder / "a.pkl", 4)
    return folder / "a.pkl"


def matlab(folder: Path) -> Path:
    from scipy.io import savemat

    motion = known(20)
    savemat(folder / "a.mat", {
        "imu_acc": motion.force, "imu_gyr": motion.rate, "imu_mag": motion.field * 1e6,
        "sampling_rate": 100.0, "opt_quat": motion.orientation, "opt_pos": motion.force,
    })  # fmt: skip
    return folder / "a.mat"


def apdm(folder: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    del h5py
    import test_apdm

    test_apdm.write_h5(folder / "a.h5", {"1": ("Head", known(20, 128.0))})
    return folder / "a.h5"


WRITERS = [xsens, mvnx, xio, xio_quaternion, csv, mapping, total_capture, dip_imu, matlab, apdm]


def attempt(folder: Path) -> None:
    """Convert what is in a folder; only one-line input errors may come of it."""
    columns = folder / "map.toml"
    options = ReadOptions(mapping=str(columns) if columns.exists() else None)
    sources = [p for p in folder.iterdir() if p != columns]
    try:
        source = read_source(sources, options=options)
        recording_of(source, worn_sensors(source, None))
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) > 20


@pytest.mark.parametrize("write", WRITERS, ids=lambda w: w.__name__)
def test_damaged_files(tmp_path, write):
    rng = np.random.default_rng(1)
    sound = tmp_path / "sound"
    sound.mkdir()
    file = write(sound).relative_to(sound)
    attempt(sound)
    whole = (sound / file).read_bytes()
    for trial in range(40):
        damaged = tmp_path / "damaged"
        shutil.copytree(sound, damaged)
        content = bytearray(whole)
        if trial % 2:
            content = content[: rng.integers(0, len(content))]
        else:
            # The first part holds headers, where damage is worst.
            places = rng.integers(0, rng.choice([200, len(content)]), rng.integers(1, 6))
            for place in places:
                content[place % len(content)] = rng.integers(0, 256)
        (damaged / file).write_bytes(bytes(content))
        attempt(damaged)
        shutil.rmtree(damaged)
