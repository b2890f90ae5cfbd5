# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0

# Everything runs in a .venv of this checkout, made when it is first needed; nothing needs
# root or a ROS installation. `make help` lists the targets.

# The python that .venv is made from: the first of these that runs and is in range.
PYTHON ?= python3 python3.11 python3.12
SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 12))

# A bag to draw, for `make draw`; by default the demo's.
BAG ?= $(patsubst %/metadata.yaml,%,$(lastword $(sort $(wildcard demo_output/*/metadata.yaml))))

# A sourced ROS puts its own rclpy and its libraries, built for one Python and one NumPy, in
# front of the venv's, and the two do not mix. So what runs here does not see them. A `ros2`
# on the PATH needs them back: whoever starts it finds them under SOURCED_ (empty if unset).
SOURCED := PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH RMW_IMPLEMENTATION
$(foreach name,$(SOURCED),$(eval export SOURCED_$(name) := $($(name))))
unexport $(SOURCED)
# Set by the ROS wheels once they have put their libraries on LD_LIBRARY_PATH, which is gone.
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE

SHELL := /bin/sh
.SHELLFLAGS := -eu -c
.ONESHELL:
.DELETE_ON_ERROR:
.PHONY: help demo test lint bench soak matrix figures draw docs clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "%-8s %s\n", $$1, $$2 }' Makefile

demo: .venv/kernels  ## fly the stall and its recovery over DDS, record it, draw it
	.venv/bin/python -m poststall_sim.demo $(ARGS)

# Computing is shared out to all cores. What talks DDS in real time waits more than it computes:
# two files of it run side by side, and nothing else.
test: .venv/kernels  ## the tests, all but the soak; ARGS='-k trim' picks some
	@export OPENBLAS_NUM_THREADS=1
	computing=0 talking=0 nothing=5
	.venv/bin/pytest -n auto -m 'not ros and not soak' $(ARGS) || computing=$$?
	.venv/bin/pytest -n 2 --dist loadfile -m 'ros and not soak' $(ARGS) || talking=$$?
	[ $$computing = $$nothing ] && [ $$talking = $$nothing ] && exit $$nothing
	for code in $$computing $$talking; do
		[ $$code = 0 ] || [ $$code = $$nothing ] || exit $$code
	done

lint: .venv/installed  ## style and import contract
	.venv/bin/ruff check .
	.venv/bin/lint-imports

bench: .venv/kernels  ## how fast, one question per benchmark
	.venv/bin/pytest benchmark $(ARGS)

soak: .venv/kernels  ## the tests and the benchmarks that take minutes
	.venv/bin/pytest -m soak test benchmark $(ARGS)

figures: .venv/kernels  ## draw the figures and tables of docs and README; ARGS='3_3 table' picks some
	.venv/bin/python tools/figures.py $(ARGS)

docs: .venv/docs  ## the site, docs/_build/html/index.html; a warning is an error
	.venv/bin/python -m sphinx -W --keep-going -q $(ARGS) docs docs/_build/html

draw: .venv/installed  ## draw a bag again; BAG=folder, by default the demo's
	.venv/bin/poststall plot $(or $(BAG),$(error no bag: run `make demo`, or give BAG=folder))

# numba notices a change in a compiled function, not in one that it calls from another file.
.venv/kernels: .venv/installed $(wildcard poststall_sim/*.py poststall_sim/aero/*.py)
	@find poststall_sim -name '*.nb[ci]' -delete
	touch $@

# A venv of a Python that has gone, or one half made, is made again. Debian and Ubuntu keep
# ensurepip, which gives a venv its pip, in a package of its own: without it, the pip or the
# virtualenv of the machine does as well.
.venv/installed: setup.py
	@make_venv() {
		rm -rf .venv
		"$$1" -m venv .venv && return
		"$$1" -m venv --without-pip .venv && "$$1" -m pip --python .venv install -q pip && return
		"$$1" -m virtualenv -q --clear .venv && return
	} >/dev/null 2>&1
	in_range=
	if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
		for python in $(PYTHON); do
			"$$python" -c '$(SUPPORTED)' >/dev/null 2>&1 || continue
			in_range=$$python
			make_venv "$$python" && break
		done
		if [ -z "$$in_range" ]; then
			echo 'No Python 3.11 or 3.12 runs here, looked for: $(PYTHON). Name one: make PYTHON=/path/to/python3.12' >&2
			exit 1
		fi
		if ! .venv/bin/python -m pip --version >/dev/null 2>&1; then
			rm -rf .venv
			echo "$$in_range cannot make a venv, for want of ensurepip most likely: install python3-venv (apt) or virtualenv (pip)." >&2
			exit 1
		fi
	fi
	echo "Installing into .venv with $$(.venv/bin/python --version): once, about a minute."
	.venv/bin/python -m pip install -q --disable-pip-version-check -e '.[all,test,lint]'
	touch $@

.venv/docs: .venv/installed
	@.venv/bin/python -m pip install -q --disable-pip-version-check -e '.[docs]'
	touch $@

# Both ends of what users have: Ubuntu 24.04 ships numpy 1.26.4 and scipy 1.11.4.
matrix:  ## python 3.11 and 3.12, each with numpy 1.26 and 2: the tests that are not slow
	@export OPENBLAS_NUM_THREADS=1
	report= ran= failed=
	for version in 3.11 3.12; do
		python=
		for candidate in python$$version "$${PYENV_ROOT:-$$HOME/.pyenv}"/versions/$$version.*/bin/python; do
			"$$candidate" -c '' >/dev/null 2>&1 || continue
			python=$$candidate
			break
		done
		for numpy in 1.26 2; do
			name=py$$version-numpy$$numpy
			venv=.matrix/$$name
			case $$numpy in
				1.26) pins='numpy==1.26.* scipy==1.11.4' ;;
				*) pins="numpy==$$numpy.*" ;;
			esac
			if [ -z "$$python" ]; then
				result="skipped: no python$$version runs here"
			elif ! { [ $$venv/installed -nt setup.py ] || {
					"$$python" -m venv --clear $$venv &&
					$$venv/bin/python -m pip install -q --disable-pip-version-check \
						-e '.[all,test]' $$pins &&
					touch $$venv/installed
				}; }; then
				result='FAILED to install' failed=yes
			else
				echo "== $$name"
				# numba's cache does not tell one NumPy from another; see also .venv/kernels.
				rm -rf $$venv/numba
				if NUMBA_CACHE_DIR=$$venv/numba $$venv/bin/pytest \
						-m 'not slow and not soak' $(ARGS); then
					result=passed ran=yes
				else
					result=FAILED failed=yes
				fi
			fi
			report="$$report$$name: $$result\n"
		done
	done
	printf "\n$$report"
	[ -z "$$failed" ] && [ -n "$$ran" ]

clean:  ## remove all that the targets and colcon have made
	rm -rf .venv .matrix demo_output docs/_build build install log *.egg-info
	rm -rf .pytest_cache .ruff_cache .import_linter_cache .hypothesis .benchmarks
	find poststall_sim test launch tools -name __pycache__ -prune -exec rm -rf {} +
