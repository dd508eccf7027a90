"""Files appear whole or not at all."""

from __future__ import annotations

import os

import pytest
from io_samples import random_recording

from mocap_jax.errors import InputError
from mocap_jax.io import write_recording
from mocap_jax.io.atomic import atomic_file


def test_earlier_file_stays_until_the_new_one_is_complete(tmp_path) -> None:
    path = tmp_path / "a"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_file(path) as stream:
        stream.write(b"new")
        raise RuntimeError
    assert path.read_text() == "old" and os.listdir(tmp_path) == ["a"]
    with atomic_file(path) as stream:
        stream.write(b"new")
        assert path.read_text() == "old"
    assert path.read_text() == "new" and os.listdir(tmp_path) == ["a"]


def test_full_disk_is_one_sentence(tmp_path) -> None:
    with pytest.raises(InputError, match="a: cannot write: No space left"):
        with atomic_file(tmp_path / "a"):
            raise OSError(28, "No space left on device")
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(("name", "reason"), [
    ("none/a.mcap", "no folder"), (".", "it is a folder"), ("x" * 300, "cannot write"),
    ("nul\0", "cannot write"),
])  # fmt: skip
def test_places_that_cannot_be_written(tmp_path, body, name, reason) -> None:
    with pytest.raises(InputError, match=reason):
        write_recording(f"{tmp_path}/{name}", random_recording(body, n=5))
    assert not os.listdir(tmp_path)


def test_devices_are_not_replaced(tmp_path) -> None:
    with pytest.raises(InputError, match="not a regular file"):
        with atomic_file(os.devnull):
            pass
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="not a regular file"):
        with atomic_file(tmp_path / "pipe"):
            pass


def test_links_keep_pointing_at_their_target(tmp_path) -> None:
    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    with atomic_file(tmp_path / "link") as stream:
        stream.write(b"new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "target").read_text() == "new"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_files_and_folders(tmp_path) -> None:
    (tmp_path / "a").write_text("old")
    (tmp_path / "a").chmod(0o444)
    with pytest.raises(InputError, match="read-only"), atomic_file(tmp_path / "a"):
        pass
    tmp_path.chmod(0o555)
    with pytest.raises(InputError, match="Permission denied"), atomic_file(tmp_path / "b"):
        pass
    tmp_path.chmod(0o755)
