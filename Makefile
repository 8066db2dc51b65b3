# `make test` and `make demo` do all the set-up themselves, once: Python 3.11 to 3.13 with venv and a C compiler are enough.
.PHONY: test test-slow test-slow-in-turn mutations test-without-ros test-oldest lint kernels package colcon docs docs-tests tables docs-check demo lock sbom release clean
.DELETE_ON_ERROR:

# Of these, the first that there is makes the environments; the oldest libraries have no wheels for the newest one.
PYTHONS ?= python3.13 python3.12 python3.11 python3

# Two files of tests at a time: more would compile the same kernels more often than they save.
TWO := --numprocesses 2 --dist loadfile

# As they stand: a long file that has few tests would otherwise come last and leave a process idle.
IN_ORDER := --no-loadscope-reorder

# ROS finds packages below the environment's root; its log and matplotlib's font cache stay in the checkout.
export AMENT_PREFIX_PATH := $(CURDIR)/.venv
export ROS_LOG_DIR := $(CURDIR)/build/ros_log
export MPLCONFIGDIR := $(CURDIR)/build/matplotlib
# rclpy writes a float32 or an int into a float field as garbage unless told to look.
export ROS_PYTHON_CHECK_FIELDS := 1
# As the command line sets it: more threads on the small matrices here take two to ten times the time on a busy machine.
export OPENBLAS_NUM_THREADS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# Bytecode is left to the first import: most of what is installed is never imported, and pip takes half of its time for it.
QUICKLY := --quiet --no-compile
# A sourced ROS installation must not mix with the pinned one; the last is how its wheels mark a set library path.
unexport PYTHONPATH LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
# Images for containers often set it: each process that a test starts would compile numpy and all others anew, for seconds.
unexport PYTHONDONTWRITEBYTECODE

# Laws through the public names, the command line and the nodes, and the formulas of the kernels.
test: .venv/installed
	@echo "== 1 of 2: style, types, layers; kernels are compiled"
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=target lint kernels
	@echo "== 2 of 2: tests"
	@.venv/bin/python -m pytest $(TWO) $(IN_ORDER) -m "not slow" --ignore test/docs --durations 10 --durations-min 1

# More of the same laws, at a length that finds what a short run does not (marker `slow`); SLOW_PART=3/8 runs one part of eight.
test-slow: kernels
	.venv/bin/python -m pytest $(TWO) $(IN_ORDER) -m slow --ignore test/docs

# Of the slow tests, what CI has time for: one of SLOW_PARTS even parts, commit by commit.
SLOW_PARTS := 8
test-slow-in-turn: kernels
	SLOW_PART=$$(( $$(git rev-list --count HEAD) % $(SLOW_PARTS) ))/$(SLOW_PARTS) \
		.venv/bin/python -m pytest $(TWO) $(IN_ORDER) -m slow --ignore test/docs

# How many of 40 small faults in the package the tests find: takes hours, and goes on where it was stopped.
mutations: kernels
	.venv/bin/python test/mutations.py

lint: .venv/installed
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	.venv/bin/lint-imports --no-logo
	.venv/bin/python benchmarks/structure.py --check

kernels: .venv/installed
	.venv/bin/leg-wear-monitor cache --fill

demo: .venv/installed
	.venv/bin/leg-wear-monitor demo --out build/demo

# With the libraries of `make test`, but without ROS, whose wheels are for x86-64 only.
test-without-ros: .venv-without-ros/installed
	.venv-without-ros/bin/python -m pytest $(TWO) $(IN_ORDER) -m "not slow" --ignore test/docs

# The oldest libraries we support, without ROS; their deprecations are not ours to mend.
test-oldest: .venv-oldest/installed
	.venv-oldest/bin/python -m pytest $(TWO) -W default -m "not slow" --ignore test/docs

# What numba compiles for every x86-64 processor since about 2015, and the tag of a wheel that carries it.
BASELINE := NUMBA_CPU_NAME=x86-64-v3 NUMBA_CPU_FEATURES=
TAGS = --python-tag $$(.venv/bin/python -c 'import sys; print("cp%d%d" % sys.version_info[:2])') --platform-tag manylinux_2_17_x86_64

# Two wheels: one for any machine, and on x86-64 one that carries machine code, so that nothing is compiled at the first start.
# What setuptools built before may be out of date.
build/wheel: .venv/installed FORCE
	rm -rf build/lib build/bdist.* build/wheel build/unpacked build/machine_code
	.venv/bin/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir build/wheel .
	test "$$(uname -m)" != x86_64 || $(MAKE) --no-print-directory build/machine_code
build/machine_code: .venv/installed FORCE
	$(BASELINE) NUMBA_CACHE_DIR=$(CURDIR)/$@ .venv/bin/leg-wear-monitor cache --fill
	.venv/bin/python -m wheel unpack --dest build/unpacked build/wheel/*.whl
	mv $@/leg_wear_monitor build/unpacked/leg_wear_monitor-$(VERSION)/leg_wear_monitor/compiled/machine_code
	.venv/bin/python -m wheel pack --dest-dir build/unpacked build/unpacked/leg_wear_monitor-$(VERSION)
	.venv/bin/python -m wheel tags --remove $(TAGS) build/unpacked/*.whl
	mv build/unpacked/*.whl build/wheel
FORCE:

# The wheels in an empty environment, without ROS and away from the checkout; the one with machine code compiles nothing.
package: build/wheel
	rm -rf build/package
	.venv/bin/python -m venv --without-pip build/package
	.venv/bin/python -m pip --python build/package/bin/python install $(QUICKLY) --only-binary :all: \
		--constraint constraints.txt $$(ls -t build/wheel/*.whl | head -n 1)
	cd build/package && unset AMENT_PREFIX_PATH && export NUMBA_CACHE_DIR=$$PWD/cache && bin/leg-wear-monitor --help \
		&& bin/leg-wear-monitor check && bin/leg-wear-monitor simulate --clearances none && bin/python -c 'import leg_wear_monitor' \
		&& { test "$$(uname -m)" != x86_64 || ! find cache -name '*.nbc' | grep .; }

# As in a ROS 2 workspace, with a selection of the tests. colcon runs the Python that runs it: the one that has our libraries.
# Where pytest-cov is installed, it writes a page of coverage for every file unless told not to.
COLCON = PYTHONPATH=$(wildcard .venv-tools/lib/python3*/site-packages) .venv/bin/python .venv-tools/bin/colcon --log-base build/colcon/log
COLCON_BASES := --base-paths . --build-base build/colcon/build
colcon: .venv/installed .venv-tools/installed
	rm -rf build/colcon
	$(COLCON) build $(COLCON_BASES) --install-base build/colcon/install
	$(COLCON) test $(COLCON_BASES) --install-base build/colcon/install \
		--pytest-args test/test_packaging.py test/doors/test_public_names.py --no-cov
	$(COLCON) test-result --test-result-base build/colcon/build --verbose

# The documentation site, without network: build/docs/index.html, and a browser on it where there is a screen.
docs: .venv/installed .venv-docs/installed docs-tests
	PYTHONPATH=$$(echo .venv-docs/lib/python3*/site-packages) .venv/bin/python -m sphinx \
		-q -n -W --keep-going -d build/doctrees docs build/docs
	@echo "build/docs/index.html"
	@test -n "$$CI" || test -z "$$DISPLAY$$WAYLAND_DISPLAY" || .venv/bin/python -m webbrowser build/docs/index.html

# Links, generated pages, tutorials, examples, the texts of README: what documents say is there, and is true.
docs-tests: kernels
	.venv/bin/python -m pytest $(TWO) $(IN_ORDER) test/docs

# The tables of documents that follow from the source; a test beside each fails while a table is out of date.
tables: .venv/installed
	.venv/bin/python test/docs/test_json_docs.py
	.venv/bin/python test/docs/test_generated_pages.py

# Spelling, and links from one document to another.
docs-check: .venv/installed .venv-tools/installed
	.venv-tools/bin/codespell *.md *.rst Makefile docs benchmarks config launch security leg_wear_monitor test
	.venv/bin/python -m pytest --quiet test/docs/test_docs_links.py

clean:
	rm -rf .venv .venv-oldest .venv-without-ros .venv-tools .venv-docs build dist docs/lessons *.egg-info .coverage .hypothesis .import_linter_cache .*_cache

# What the packages are built with comes first: without build isolation, which would fetch a setuptools that nothing pins.
.venv/installed: setup.cfg setup.py package.xml requirements-build.lock requirements.lock
	$(call environment,$(PYTHONS))
	$(call locked,requirements-build.lock)
	$(call locked,requirements.lock)
	$(@D)/bin/python -m pip install $(QUICKLY) --no-deps --no-build-isolation --editable .
	@touch $@

# Without ROS, and without hashes: the oldest ones differ from Python to Python.
.venv-oldest/installed: CONSTRAINTS := constraints-oldest.txt
.venv-without-ros/installed: CONSTRAINTS := constraints.txt
.venv-oldest/installed .venv-without-ros/installed: setup.cfg setup.py package.xml constraints-oldest.txt constraints.txt
	$(call environment,$(if $(filter .venv-oldest,$(@D)),$(filter-out python3.13,$(PYTHONS)),$(PYTHONS)))
	$(@D)/bin/python -m pip install $(QUICKLY) --constraint $(CONSTRAINTS) setuptools wheel
	$(@D)/bin/python -m pip install $(QUICKLY) --constraint $(CONSTRAINTS) --no-build-isolation --editable ".[bags,test]"
	@touch $@

.venv-docs/installed: requirements-docs.lock
	$(call environment,$(PYTHONS))
	$(call locked,requirements-docs.lock)
	@touch $@

.venv-tools/installed: requirements-build.lock requirements-tools.lock
	$(call environment,$(PYTHONS))
	$(call locked,requirements-build.lock)
	$(call locked,requirements-tools.lock)
	@touch $@

# The locks anew: of what constraints.txt pins, the hashes of all files, so that one lock serves Python 3.11 to 3.13.
lock: .venv-tools/installed
	$(LOCK) --constraint constraints.txt --extra ros --extra bags --extra test --extra lint --extra dask --extra dashboard \
		--output-file requirements.lock setup.py
	printf 'setuptools\nwheel\n' | $(LOCK) --constraint constraints.txt --output-file requirements-build.lock -
	$(LOCK) --fork-strategy fewest --constraint constraints.txt --output-file requirements-docs.lock requirements-docs.in
	printf '%s\n' $(TOOLS) | $(LOCK) --output-file requirements-tools.lock -

# A bill of materials in CycloneDX's format: all that is in the environment of `make test`, this package included.
sbom: .venv/installed .venv-tools/installed
	@mkdir -p build
	.venv-tools/bin/cyclonedx-py environment --spec-version 1.6 --output-format JSON --output-reproducible --validate \
		--output-file build/sbom.cdx.json .venv/bin/python

# What a release has, in dist/: wheel, sdist, bill of materials and checksums; its notes, of the changelog, are beside it.
# With TAG, the version and the heading in the changelog must be that of the tag.
VERSION = $(shell sed --quiet 's|.*<version>\(.*\)</version>.*|\1|p' package.xml)
TAG ?= $(VERSION)
release: package sbom
	@test "$(TAG)" = "$(VERSION)" || { echo "The tag is $(TAG), the version in package.xml $(VERSION)" >&2; exit 1; }
	awk '/^[0-9]+\.[0-9]+\.[0-9]+ \(/ {inside = $$1 == "$(TAG)"; getline; next} inside' CHANGELOG.rst >build/release_notes.rst
	@test -s build/release_notes.rst || { echo "CHANGELOG.rst has no section $(TAG) (YYYY-MM-DD)" >&2; exit 1; }
	rm -rf dist build/of_sdist
	.venv/bin/python -c 'from setuptools import build_meta; build_meta.build_sdist("dist")'
	.venv/bin/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir build/of_sdist dist/*.tar.gz
	cp build/wheel/*.whl build/sbom.cdx.json dist
	cd dist && sha256sum -- * >SHA256SUMS

TOOLS := codespell colcon-core colcon-package-selection colcon-python-setup-py colcon-recursive-crawl colcon-ros \
	colcon-test-result 'cyclonedx-bom[validation]' uv

LOCK := .venv-tools/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
	--no-emit-index-url --no-emit-find-links

# $(call locked,LOCK): install what a lock names; of empy there is only the source.
locked = $(@D)/bin/python -m pip install $(QUICKLY) --require-hashes --no-deps --no-build-isolation \
	--only-binary :all: --no-binary empy --requirement $(1)

# $(call environment,PYTHONS): a fresh environment in the target's directory, from the first Python that will do.
define environment
@for python in $(1); do \
	"$$python" -c 'import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info < (3, 14))' 2>/dev/null \
		&& exec "$$python" -m venv --clear $(@D); \
done; echo "No Python 3.11 to 3.13 with venv among: $(1) (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1
endef
