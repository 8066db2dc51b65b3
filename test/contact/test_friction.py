"""Friction: against the slip, never more than Coulomb's, nothing at rest."""

import math
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.contact.laws import (
    FRICTION_CODES,
    RAMPS,
    ambrosio_ramp,
    friction_force,
    threlfall_ramp,
)
from leg_wear_monitor.mechanism import FRICTION_LAWS

ROOT = Path(__file__).parents[2]
V0, V1 = 1.0e-3, 1.0e-2

laws = st.sampled_from(list(FRICTION_CODES.values()))
slips = st.floats(-1.0, 1.0)
loads = st.floats(0.0, 1.0e4)


@given(law=laws, mu=st.floats(0.0, 2.0), load=loads, slip=slips)
def test_friction_opposes_the_slip_and_keeps_below_coulomb(law, mu, load, slip):
    force = friction_force(law, mu, V0, V1, load, slip)
    assert force * slip <= 0.0
    assert abs(force) <= mu * load


@given(law=laws, load=loads, slip=slips)
def test_friction_is_odd(law, load, slip):
    assert friction_force(law, 0.1, V0, V1, load, -slip) == -friction_force(law, 0.1, V0, V1, load, slip)


@given(law=laws, load=loads, slip=st.floats(0.0, 1.0), more=st.floats(0.0, 1.0))
def test_ramps_rise_with_speed(law, load, slip, more):
    weak = friction_force(law, 0.1, V0, V1, load, slip)
    assert friction_force(law, 0.1, V0, V1, load, slip + more) <= weak


@given(slip=slips)
def test_a_ramp_of_no_width_is_coulomb(slip):
    fraction = ambrosio_ramp(abs(slip), V0, V0)
    assert fraction == (0.0 if abs(slip) <= V0 else 1.0)


def test_published_points_of_the_ramps():
    """Ambrosio's is 0 up to v0, 1 from v1, half way half; Threlfall's reaches 95 % at v1."""
    fractions = [ambrosio_ramp(v, V0, V1) for v in (0.0, V0, 0.5 * (V0 + V1), V1, 1.0)]
    assert fractions == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0])
    assert threlfall_ramp(V1, V0, V1) == pytest.approx(1.0 - math.exp(-3.0))
    assert threlfall_ramp(0.0, V0, V1) == 0.0


def test_a_file_can_choose_every_law_and_no_other():
    assert set(FRICTION_LAWS) == set(RAMPS)


def recipe() -> str:
    """Kernel of the example in the contributor's page."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(@kernel\ndef brown_mcphee_ramp.*?)```", page, re.DOTALL)
    assert found
    return found[1]


def test_the_kernel_of_the_contributor_s_page_is_the_published_law():
    """Brown and McPhee, Multibody System Dynamics 37, 2016: tanh(4 x) at large x, and its peak at x = 1."""
    names = {"math": math, "kernel": kernel}
    exec(recipe(), names)
    fractions = [names["brown_mcphee_ramp"](speed, V0, V1) for speed in (0.0, V1, 1000.0 * V1)]
    assert fractions == pytest.approx([0.0, math.tanh(4.0) + 0.2, 1.0], abs=1.0e-6)


@pytest.mark.slow
def test_a_law_by_the_contributor_s_page_works_in_both_models(tmp_path):
    """In a copy of the package, because its kernels are compiled anew."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "leg_wear_monitor", tmp_path / "leg_wear_monitor", ignore=ignored)
    shutil.copytree(ROOT / "config", tmp_path / "config")
    shutil.copy(ROOT / "package.xml", tmp_path)
    for name, old, new in (
        ("contact/laws.py", "RAMPS = {", f"{recipe()}\n\nRAMPS = {{'brown-mcphee': brown_mcphee_ramp, "),
        ("mechanism/__init__.py", "FRICTION_LAWS = (", "FRICTION_LAWS = ('brown-mcphee', "),
    ):
        path = tmp_path / "leg_wear_monitor" / name
        text = path.read_text()
        assert text.count(old) == 1
        path.write_text(text.replace(old, new))
    script = (
        "import leg_wear_monitor as lw\n"
        "span = {'cycles': 0.1, 'skip_cycles': 0.0}\n"
        "for model in ('clearance', 'full'):\n"
        "    for law in ('brown-mcphee', 'ambrosio', 'threlfall'):\n"
        "        joints = lw.simulate('four_bar', model=model, friction=law, **span).joints\n"
        "        print(model, joints['B'].friction_work_j_per_cycle)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    lines = done.stdout.splitlines()
    assert len(set(lines)) == 6, done.stdout
