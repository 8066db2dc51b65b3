"""A YAML file is read within bounds, and whatever it holds, it is refused in one line."""

import pytest

from leg_wear_monitor import ConfigError, load_config, load_mechanism
from leg_wear_monitor.configuration.strict import MOST_BYTES

LAUGHS = "a0: &a0 {x: 1, y: 2}\n" + "".join(
    f"a{i + 1}: &a{i + 1} {{x: *a{i}, y: *a{i}, z: *a{i}}}\n" for i in range(40)
)
HOSTILE = {
    "contains itself": ("/**: &x {ros__parameters: *x}", "line 1: &x names a list or mapping"),
    "a list in itself": ("name: &x [*x]", "line 1: &x names a list or mapping"),
    "aliases of aliases": (LAUGHS, "line 1: &a0 names a list or mapping"),
    "merge keys": ("a: 1\nb: &b {c: 1}\nd: {<<: *b}\n", "line 2: &b names a list or mapping"),
    "brackets": ("a: " + 1200 * "[", "is not YAML"),
    "code": ("name: !!python/object/apply:os.system ['touch pwned']", "is not YAML"),
    "a tag that does not fit": ("name: !!int many", "is not YAML"),
    "a set": ("name: !!set 3", "is not YAML"),
    "two documents": ("a: 1\n---\nb: 2\n", "is not YAML"),
    "too long": ("#" * (MOST_BYTES + 1), f"has more than {MOST_BYTES} bytes"),
    "empty": ("", "is not a mapping"),
}


@pytest.mark.parametrize("what", HOSTILE)
def test_hostile_yaml_is_one_line(tmp_path, what):
    text, said = HOSTILE[what]
    (tmp_path / "x.yaml").write_text(text)
    for load in (load_mechanism, load_config):
        with pytest.raises(ConfigError) as error:
            load(tmp_path / "x.yaml")
        assert "\n" not in str(error.value)
        assert said in str(error.value) or "is not a ROS parameter file" in str(error.value)
    assert not (tmp_path / "pwned").exists()


@pytest.mark.parametrize(
    "content", [b"\xff\xfe" + "a: 1".encode("utf-16-le"), b"\x00\x01\x02", bytes(range(128, 256))]
)
def test_what_is_no_text_is_one_line(tmp_path, content):
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(ConfigError, match=r"x\.yaml: (is not|nothing)"):
        load_mechanism(tmp_path / "x.yaml")


def test_a_device_is_not_read(tmp_path):
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    with pytest.raises(ConfigError, match=r"is a device\. Expected a file"):
        load_mechanism(tmp_path / "zero.yaml")


def test_a_byte_order_mark_is_no_fault(tmp_path, leg):
    text = b"\xef\xbb\xbf/**: {ros__parameters: {hardware_id: leg-7}}"
    (tmp_path / "x.yaml").write_bytes(text)
    assert load_config(tmp_path / "x.yaml").hardware_id == "leg-7"
