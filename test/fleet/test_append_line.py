"""Lines of a fleet's files are whole."""

import pytest

from leg_wear_monitor.fleet.directory import append_line

pytestmark = pytest.mark.plain


def test_a_line_that_was_cut_off_is_removed(tmp_path):
    path = tmp_path / "log"
    append_line(path, "one")
    path.write_bytes(path.read_bytes() + b"tw" * 5000)
    append_line(path, "three")
    assert path.read_text() == "one\nthree\n"
