"""Results that other kernels made are listed."""

from __future__ import annotations

from click.testing import CliRunner

from experiments import script, stale
from rigdda.kernel import kernel_statements


def test_what_other_kernels_made_is_listed(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(script, "kernels_hash", lambda: "0ld")
        script.write(tmp_path / "old.csv", [{"a": 1.0}])
    script.write(tmp_path / "new.csv", [{"a": 1.0}])
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "unknown.csv").write_text("a\n1\n")
    told = CliRunner().invoke(stale.main, ["--out", str(tmp_path)])
    assert told.exit_code == 1
    assert [line.split(": ")[1] for line in told.output.splitlines()] == [
        "made by unknown kernels",
        "0ld",
    ]
    for name in ("old.csv", "bench/unknown.csv"):
        script.write(tmp_path / name, [{"a": 2.0}])
    told = CliRunner().invoke(stale.main, ["--out", str(tmp_path)])
    assert told.exit_code == 0 and not told.output


def test_comments_and_the_module_of_a_kernel_do_not_count():
    one = b"import math\n\nA = 1  # why\n@kernel\ndef f(x):\n    'Return x.'\n    return A * x\n"
    two = b"A = 1\n@kernel\ndef f(x):\n    return A * x\n"
    assert kernel_statements(one) == kernel_statements(two)
    assert kernel_statements(one) != kernel_statements(two.replace(b"1", b"2"))
    assert not kernel_statements(b"B = 3\ndef call():\n    return f(B)\n")
