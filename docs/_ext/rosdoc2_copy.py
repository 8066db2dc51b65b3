"""rosdoc2 builds a copy of the pages, with a configuration of its own that names ours."""

import re
import shutil
from pathlib import Path

SETTINGS = {  # what rosdoc2 would add
    "enable_breathe": False,
    "enable_exhale": False,
    "enable_intersphinx": False,
    "automatically_extend_intersphinx_mapping": False,
    "override_theme": False,
}
PAGES = ["standards.rst", "standard_docs", "__readme_include.rst"]  # the site has these documents already
BESIDE = ("*.md", "*.rst", "bags/README.md", "config/monitor.yaml")  # that pages include or link to


def documents(configuration: Path) -> Path:
    """Directory of the documents whose configuration runs; a copy has beside it what they have."""
    found = re.search(r'exec\(open\("(.+?)"\)', configuration.read_text(encoding="utf-8"))
    if found is None:
        return configuration.parent
    root = Path(found[1]).parents[1]
    for file in (file for pattern in BESIDE for file in root.glob(pattern)):
        copy = configuration.parents[1] / file.relative_to(root)
        copy.parent.mkdir(exist_ok=True)
        shutil.copy(file, copy)
    return Path(found[1]).parent
