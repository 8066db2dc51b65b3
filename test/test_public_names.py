"""What `import leg_wear_monitor as lw` offers."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

import leg_wear_monitor as lw

pytestmark = pytest.mark.plain

PACKAGE = Path(__file__).parents[1] / "package.xml"


def test_dir_lists_every_public_name_before_it_is_used():
    assert set(lw.__all__) <= set(dir(lw))
    for name in lw.__all__:
        assert getattr(lw, name) is not None


def test_the_version_is_that_of_the_package():
    assert lw.__version__ == ElementTree.parse(PACKAGE).findtext("version")
    assert "__version__" in dir(lw)
