"""Options of scripts that would do nothing are refused, before anything is computed."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))

import environment

SCRIPTS = environment.ROOT / "scripts"


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("reproduce_arm_ukf --tune --seed 3", "--seed: nothing with --tune"),
        ("reproduce_arm_ukf --bound --seed 0", "--seed: nothing with --bound"),
        ("check_consistency --orientations", "--orientations: nothing without --clips"),
    ],
)
def test_options_without_effect_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, command: str, message: str
) -> None:
    script, *arguments = command.split()
    monkeypatch.setattr(environment, "enter", lambda: None)
    monkeypatch.setattr(sys, "argv", [script, *arguments])
    main = runpy.run_path(str(SCRIPTS / script), run_name="script")["main"]
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2 and message in capsys.readouterr().err
