"""All code that depends on numba: kernels, their cache, vectors.

At its import and at each compilation, numba reads ``.numba_config.yaml`` of the current directory if PyYAML
is installed. A key of this file runs code, so numba finds here neither PyYAML nor the file.
"""

import os
import sys
import warnings

sys.modules.setdefault("yaml", None)  # type: ignore[arg-type]
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # numba asks for PyYAML if the file is there
    from numba.core import config
if sys.modules["yaml"] is None:
    del sys.modules["yaml"]
config._config_fname = os.devnull
config.reload_config()

import numba as numba  # noqa: E402
