# `make test` and `make demo` do all the set-up themselves, once: Python 3.11 to 3.13 with venv and a C compiler are enough.
.PHONY: test demo campaign test-oldest clean
.DELETE_ON_ERROR:

# Percent of lines and branches that the two runs of the tests reach together.
COVERAGE_MIN ?= 90

# Two files of tests at a time: more would compile the same kernels more often than they save.
TWO := --numprocesses 2 --dist loadfile

# ROS finds packages below the environment's root; its log and matplotlib's font cache stay in the checkout.
export AMENT_PREFIX_PATH := $(CURDIR)/.venv
export ROS_LOG_DIR := $(CURDIR)/build/ros_log
export MPLCONFIGDIR := $(CURDIR)/build/matplotlib
# rclpy writes a float32 or an int into a float field as garbage unless told to look.
export ROS_PYTHON_CHECK_FIELDS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# A sourced ROS installation must not mix with the pinned one; the last is how its wheels mark a set library path.
unexport PYTHONPATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE

test: .venv/installed
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	.venv/bin/lint-imports --no-logo
	.venv/bin/python -m pytest $(TWO) --cov --cov-report=
	@# Coverage cannot see into compiled kernels: once more, uncompiled, and the sum of both is judged.
	NUMBA_DISABLE_JIT=1 .venv/bin/python -m pytest $(TWO) -m plain --cov --cov-append --cov-fail-under=$(COVERAGE_MIN)

demo: .venv/installed
	.venv/bin/leg-wear-monitor demo --out build/demo

# Hostile users by the hundred, minutes to an hour (docs/campaign.md); the tests run a few of each family.
campaign: .venv/installed
	PYTHONPATH=test .venv/bin/python -m campaign

# The oldest libraries we support, without ROS; their deprecations are not ours to mend.
test-oldest: .venv-oldest/installed
	.venv-oldest/bin/python -m pytest $(TWO) -W default

clean:
	rm -rf .venv .venv-oldest build dist *.egg-info .coverage .hypothesis .import_linter_cache .*_cache

.venv/installed: setup.cfg setup.py package.xml constraints.txt
	$(call install,python3.13 python3.12 python3.11 python3,constraints.txt,ros$(comma)bags$(comma)test$(comma)lint$(comma)dask)

.venv-oldest/installed: setup.cfg setup.py package.xml constraints-oldest.txt
	$(call install,python3.12 python3.11 python3,constraints-oldest.txt,bags$(comma)test)

comma := ,

# $(call install,PYTHONS,CONSTRAINTS,EXTRAS): a fresh environment in the target's directory, from the first Python
# that will do. No build isolation: that would fetch a setuptools that the constraints do not pin.
define install
@for python in $(1); do \
	"$$python" -c 'import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null \
		&& exec "$$python" -m venv --clear $(@D); \
done; echo "No Python 3.11 to 3.13 with venv among: $(1) (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1
$(@D)/bin/python -m pip install --quiet --constraint $(2) setuptools wheel
$(@D)/bin/python -m pip install --quiet --constraint $(2) --no-build-isolation --editable ".[$(3)]"
@touch $@
endef
