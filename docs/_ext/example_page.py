"""A Sphinx extension: beside the pages of the site, the page of a replay, ``example/report.html``."""

import subprocess
import sys
from pathlib import Path
from typing import Any

BAG = Path(__file__).parents[2] / "bags" / "knocking"


def _replay(app: Any, error: Exception | None) -> None:
    if error is not None or app.builder.format != "html":
        return
    command = [sys.executable, "-m", "leg_wear_monitor", "replay", f"{BAG}.mcap", "--config", f"{BAG}.yaml"]
    command += ["--out", str(Path(app.outdir) / "example")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        from sphinx.errors import ExtensionError

        raise ExtensionError(f"{' '.join(command)} ended with {done.returncode}: {done.stderr}")


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("build-finished", _replay)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
