"""A Sphinx extension: pages that include a document of the package's root link to others of them.

A link such as ``SECURITY.md`` in a root document is right on a forge; on the site it leads to the page that
includes that document.
"""

from typing import Any

PAGES = {
    "CONTRIBUTING.md": "project/contributing",
    "QUALITY_DECLARATION.md": "project/quality",
    "SECURITY.md": "project/security",
}


def _link(_app: Any, doctree: Any) -> None:
    from sphinx.addnodes import pending_xref

    for link in doctree.findall(pending_xref):
        path, _, anchor = link["reftarget"].partition("#")
        if link["reftype"] == "myst" and path in PAGES:
            link["refdomain"], link["reftarget"], link["reftargetid"] = "doc", PAGES[path], anchor or None


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("doctree-read", _link)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
