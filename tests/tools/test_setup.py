"""tools/setup: what installing must not do."""

import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def test_a_linked_environment_is_not_emptied(tmp_path):
    checkout, other = tmp_path / "checkout", tmp_path / "other"
    for name in ("setup", "requirements.lock", "pyproject.toml"):
        (checkout / "tools").mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "tools" / name, checkout / "tools")
    other.mkdir()
    (other / "kept").write_text("of another checkout")
    (checkout / ".venv").symlink_to(other)
    run = subprocess.run([checkout / "tools" / "setup", "--local", "python"], capture_output=True, text=True)
    assert run.returncode == 1
    assert run.stderr == ("millsim: .venv is a link, and what it leads to would be emptied: remove the link\n")
    assert (other / "kept").exists()
