"""A Sphinx extension: links of the package's root documents, in the pages that include them.

On a forge, ``SECURITY.md`` and ``docs/reference/ros.md`` are right. On the site the first one leads to the
page that includes that document, and the second one is a page by its place below docs/.
"""

from pathlib import PurePosixPath
from typing import Any

PAGES = {
    "CODE_OF_CONDUCT.md": "project/conduct",
    "CONTRIBUTING.md": "project/contributing",
    "QUALITY_DECLARATION.md": "project/quality",
    "SECURITY.md": "project/security",
}


def _link(_app: Any, doctree: Any) -> None:
    from sphinx.addnodes import pending_xref

    for link in doctree.findall(pending_xref):
        path, _, anchor = link["reftarget"].partition("#")
        page = PAGES.get(path)
        if path.startswith("docs/"):
            page = str(PurePosixPath(path).relative_to("docs").with_suffix(""))
        if link["reftype"] == "myst" and page is not None:
            link["refdomain"], link["reftarget"], link["reftargetid"] = "doc", page, anchor or None


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("doctree-read", _link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
