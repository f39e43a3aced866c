# Needs make and Python 3.11 or later; everything else is installed into $(VENV).
# Another interpreter: make test PYTHON=python3.12, which has an environment of its own, .venv-3.12

ifneq ($(origin PYTHON),undefined)
VENV ?= .venv-$(shell $(PYTHON) -c "import sys; print('%d.%d' % sys.version_info[:2])")
endif
PYTHON ?= python3
VENV ?= .venv
EXAMPLES ?= 500
NEWEST ?= python3.14
SITE := docs/_build/html
VENDOR := optuav/explorer/static/vendor
BIN := $(VENV)/bin
CACHES := $(abspath $(VENV))/caches
PIP := $(BIN)/python -m pip --disable-pip-version-check
# Most of what is installed is never imported, and to compile it all takes longer than all the rest
INSTALL := $(PIP) install --quiet --no-compile
PYTEST := $(BIN)/python -m pytest -o "cache_dir=$(CACHES)/pytest"

# In the environment, as a checkout may be read-only
export MYPY_CACHE_DIR = $(CACHES)/mypy
export RUFF_CACHE_DIR = $(CACHES)/ruff

# Without bytecode, each worker compiles 250 files of tests anew, and each subprocess the package
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test test-only test-browser test-portable test-lowest test-latest doctest docs docs-open lessons lint
.PHONY: bench bench-modellers cells soak pins vendor clean

run: $(VENV)/run.stamp
	$(BIN)/optuav solve paper --plot plan-paper
	$(BIN)/optuav solve matrice350 --plot plan-matrice350

test: lint test-only

test-only: $(VENV)/dev.stamp
	$(PYTEST) -n 2 --dist worksteal $(TESTS)

# The explorer in a headless Chromium, which is not installed here.
test-browser: $(VENV)/dev.stamp
	$(PYTEST) -q -m page tests/explorer tests/test_notebook.py

doctest: $(VENV)/dev.stamp
	$(PYTEST) -q tests/test_examples_of_public_names.py

# Lessons run when they or the packages have changed.
docs: $(VENV)/docs.stamp
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --write-all -d docs/_build/doctrees docs $(SITE)
	BUILT_SITE="$(abspath $(SITE))" $(PYTEST) -q tests/test_site.py
	@$(MAKE) --no-print-directory docs-open

docs-open:
	@test -f $(SITE)/index.html || { echo "there is no site yet: make docs" >&2; exit 1; }
	@echo "open $(CURDIR)/$(SITE)/index.html"

# The notebooks in the package, and build/lessons for nbgrader and Otter.
lessons: $(VENV)/dev.stamp
	$(BIN)/python docs/make_lessons.py

# A selection: make test-portable TESTS="tests/cli -x"
test-portable: $(VENV)/dev.stamp
	$(BIN)/python tests/portable.py -n 2 --dist worksteal $(TESTS)

# With the lowest versions that pyproject.toml allows.
test-lowest: $(VENV)-lowest/installed.stamp
	$(VENV)-lowest/bin/python -m pytest -n 2 --dist worksteal $(TESTS)

# With the newest versions that pyproject.toml allows, of this day: nothing is kept.
test-latest:
	$(MAKE) $(VENV)-latest/created.stamp VENV=$(VENV)-latest
	$(VENV)-latest/bin/python -m pip --disable-pip-version-check install --quiet --no-compile --upgrade \
	    --upgrade-strategy eager --group dev --editable ".[all]"
	$(VENV)-latest/bin/python -m pip --disable-pip-version-check install --quiet --no-deps --only-binary :all: \
	    --requirement tests/city/requirements.txt
	$(VENV)-latest/bin/python -m pytest -n 2 --dist worksteal $(TESTS)

lint: $(VENV)/dev.stamp
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --cache-dir "$(CACHES)/imports"

bench: $(VENV)/dev.stamp
	$(BIN)/python -m benchmarks

bench-modellers: $(VENV)-bench/installed.stamp
	$(VENV)-bench/bin/python -m benchmarks modellers

# Six minutes of one core.
cells: $(VENV)-cells/installed.stamp
	$(VENV)-cells/bin/python -m benchmarks.cells

# More fresh examples of each property: make soak EXAMPLES=10000
soak: $(VENV)/dev.stamp
	EXAMPLES=$(EXAMPLES) $(PYTEST) -n 2 --dist worksteal -m "soak or campaign" --hypothesis-profile=soak

# For the oldest Python, and for later ones where the newest libraries need one. With names of both:
# make pins PYTHON=python3.11 NEWEST=python3.14
pins:
	rm -rf build/pins
	mkdir -p build/pins
	set -e; for python in old:$(PYTHON) new:$(NEWEST); do \
	    to=build/pins/$${python%%:*}; \
	    pip="$(VENV)-pins/bin/python -m pip --quiet --disable-pip-version-check"; \
	    freeze="$$pip freeze --all --exclude pip --exclude optuav"; \
	    $${python#*:} -m venv --clear $(VENV)-pins; \
	    $$pip install --upgrade "pip>=25.1" setuptools; \
	    $$pip install --no-compile --group dev ".[all]"; \
	    $$freeze > $$to-dev; \
	    $$pip install --no-compile --constraint $$to-dev --group docs; \
	    $$freeze | grep -vxFf $$to-dev > $$to-docs; \
	done
	echo "# Written by 'make pins' for Python 3.11 to 3.14." > requirements-dev.txt
	echo "# Written by 'make pins', on top of requirements-dev.txt." > requirements-docs.txt
	set -e; for group in dev docs; do \
	    old=build/pins/old-$$group new=build/pins/new-$$group; \
	    { grep -xFf $$new $$old; \
	      grep -vxFf $$new $$old | sed 's/$$/ ; python_version < "3.12"/'; \
	      grep -vxFf $$old $$new | sed 's/$$/ ; python_version >= "3.12"/'; } \
	        | LC_ALL=C sort -f >> requirements-$$group.txt; \
	done
	rm -rf $(VENV)-pins build/pins

# The libraries of the explorer's page and the licences of all that is in them, from npm.
vendor:
	rm -rf build/vendor
	mkdir -p build/vendor
	set -e; while read -r package file; do \
	    name=$$(basename $${package%@*}); \
	    packed=$$(npm pack --silent --pack-destination build/vendor $$package); \
	    tar -xzf build/vendor/$$packed -C build/vendor; \
	    cp build/vendor/package/LICENSE $(VENDOR)/$$name.LICENSE; \
	    [ -z "$$file" ] || cp build/vendor/package/$$file $(VENDOR)/; \
	    rm -rf build/vendor/package; \
	done < $(VENDOR)/versions.txt

clean:
	rm -rf $(VENV) $(VENV)-bench $(VENV)-cells $(VENV)-lowest $(VENV)-latest .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist docs/_build docs/api docs/lessons docs/project plan-paper plan-matrice350 reproduced

$(VENV)/created.stamp:
	@$(PYTHON) -c "import sys; v = sys.version_info[:2]; sys.exit(v < (3, 11) and '$(PYTHON) is Python %d.%d' % v)" || { \
	    echo "optuav needs Python 3.11 or later. Name one: make PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	touch $@

$(VENV)/run.stamp: pyproject.toml requirements-dev.txt | $(VENV)/created.stamp
	$(INSTALL) --constraint requirements-dev.txt --editable ".[plot,frame]"
	touch $@

$(VENV)/dev.stamp: pyproject.toml requirements-dev.txt tests/city/requirements.txt | $(VENV)/created.stamp
	$(INSTALL) --requirement requirements-dev.txt
	$(INSTALL) --no-build-isolation --no-deps --editable .
	$(INSTALL) --no-deps --only-binary :all: --requirement tests/city/requirements.txt
	touch $@ $(VENV)/run.stamp

$(VENV)/docs.stamp: requirements-docs.txt $(VENV)/dev.stamp
	$(INSTALL) --requirement requirements-docs.txt --constraint requirements-dev.txt
	touch $@

$(VENV)-lowest/installed.stamp: pyproject.toml tests/city/requirements.txt
	$(MAKE) $(VENV)-lowest/created.stamp VENV=$(VENV)-lowest
	$(VENV)-lowest/bin/python -m pip --disable-pip-version-check install --quiet pytest-xdist hypothesis editables nbformat \
	    $$(grep -oE '"[][a-z-]+>=[0-9.]+"' pyproject.toml | tr -d '"' | sed 's/>=/==/')
	$(VENV)-lowest/bin/python -m pip install --quiet --no-build-isolation --no-deps --editable .
	$(VENV)-lowest/bin/python -m pip install --quiet --no-deps --only-binary :all: --requirement tests/city/requirements.txt
	touch $@

# The modellers that the closed form is measured against are in no other environment.
$(VENV)-bench/installed.stamp: benchmarks/requirements.txt pyproject.toml requirements-dev.txt
	$(MAKE) $(VENV)-bench/dev.stamp VENV=$(VENV)-bench
	$(VENV)-bench/bin/python -m pip install --quiet --requirement benchmarks/requirements.txt
	touch $@

# Without pins, as PyBaMM needs an older CasADi.
$(VENV)-cells/installed.stamp: pyproject.toml
	$(MAKE) $(VENV)-cells/created.stamp VENV=$(VENV)-cells
	$(VENV)-cells/bin/python -m pip install --quiet --upgrade "pip>=25.1"
	$(VENV)-cells/bin/python -m pip install --quiet --group cells --editable ".[plot,frame]"
	touch $@
