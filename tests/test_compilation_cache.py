"""The cache of compiled programs: where it is, and that it is off where it cannot be."""

from __future__ import annotations

import jax
import pytest

from mocap_jax.compilation_cache import VARIABLE, default_cache_folder, enable_compilation_cache


@pytest.fixture(autouse=True)
def no_cache_folder():
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", None)
    yield
    jax.config.update("jax_compilation_cache_dir", before)


def test_uses_and_makes_the_named_folder(tmp_path):
    folder = enable_compilation_cache(tmp_path / "a" / "b")
    assert folder is not None and folder.is_dir()
    assert jax.config.jax_compilation_cache_dir == str(folder)


def test_leaves_a_folder_chosen_before_in_place(tmp_path):
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    assert enable_compilation_cache(tmp_path / "other") == tmp_path


def test_environment_names_the_folder_or_switches_it_off(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert enable_compilation_cache() == tmp_path
    jax.config.update("jax_compilation_cache_dir", None)
    monkeypatch.setenv(VARIABLE, "off")
    assert enable_compilation_cache() is None


def test_default_follows_the_desktop_convention(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_cache_folder() == tmp_path / "mocap_jax"


def test_is_off_where_the_folder_cannot_be_made(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    assert enable_compilation_cache(file / "below") is None
    assert jax.config.jax_compilation_cache_dir is None
