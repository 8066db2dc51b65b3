"""What `import leg_wear_monitor as lw` offers."""

import pytest

import leg_wear_monitor as lw

pytestmark = pytest.mark.plain


def test_dir_lists_every_public_name_before_it_is_used():
    assert set(lw.__all__) <= set(dir(lw))
    for name in lw.__all__:
        assert getattr(lw, name) is not None
