# make quick  lints, and runs the contracts and the stored trajectories: half a minute, between two edits
# make run    installs, reproduces Fig. 4, trains a residual policy and, by gradients, a controller from scratch, and evaluates them
# make test   installs and runs the tests; make test-slow runs those marked slow, make test-all both at once
# make portable runs tests of bits as other processors would, make oldest with the oldest Numba
# make fuzz tries odd input on everything that is read or called, and make kills disturbs every command at random moments (hours)
# make mutation changes physics and controllers to see whether a test fails (hours); make soak runs 10^8 policy steps (half an hour)
# make test-weekly runs tests too slow for every commit, and real clients, each in an environment of its own (an hour or two)
# make lint   ruff, mypy and the order of the packages; make bench prints speeds, of built code too
# make pictures redraws the pictures of the README's gallery and the studies (some minutes)
# make results runs every study whose result is stale, and writes the tables and pictures that show them
# make policies trains the policies that come with the package (an hour or so); make learned evaluates them
# make scratch trains PPO from scratch
# make lock pins every file of an installation; make audit, make sbom and make lint-workflows look at the supply chain
# make docs builds the documentation site in out/docs and runs its notebooks; make docs-links looks at its links to the internet
# make devcontainer writes .devcontainer/, where VS Code and Codespaces look, from packaging/container
# make page builds the code and data of the page's rig, which the package carries, after a change of kernels, policies, words or version
# make kernels builds the machine code that the package carries, at a release; between two, Numba compiles what was edited
# make targets builds the loop without Python for every target and writes docs/laboratory/targets.md (some minutes; qemu-user runs aarch64)

VENV := .venv
BIN := $(VENV)/bin
BASE := $(VENV)/.base
TORCH := $(VENV)/.torch
AGENTS := $(VENV)/.agents
PROJECT := $(VENV)/.project
READY := $(VENV)/.ready
OUT := out
TOOLS := $(OUT)/tools
NPM := $(OUT)/npm
MUTMUT := $(OUT)/mutmut
OLDEST := $(OUT)/oldest
PYTEST := $(BIN)/python -m pytest -n 2 --durations 20 --durations-min 1
# --no-input: a failing index must fail, not wait for somebody to type.
PIP := $(BIN)/python -m pip --disable-pip-version-check --no-input
# Every file of an installation has its hash in packaging/requirements/, which make lock writes from constraints.txt.
# Python writes the byte code of what is imported, and keeps it: --no-compile leaves out the rest.
LOCKED := install --quiet --no-deps --no-compile --require-hashes --requirement packaging/requirements
export PYTHONDONTWRITEBYTECODE :=
LOCK := $(TOOLS)/bin/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate \
  --custom-compile-command "make lock" --constraint constraints.txt --output-file packaging/requirements
TORCH_CPU := --index-url https://download.pytorch.org/whl/cpu --retries 1
# What an installation here has; cluster (Ray) is left out.
EXTRAS := agents onnx tune sweep control jax build log video live docs dev
CUDA := torch triton cuda-bindings cuda-pathfinder cuda-toolkit nvidia-cublas nvidia-cuda-cupti nvidia-cuda-nvrtc nvidia-cuda-runtime \
  nvidia-cudnn-cu13 nvidia-cufft nvidia-cufile nvidia-curand nvidia-cusolver nvidia-cusparse nvidia-cusparselt-cu13 nvidia-nccl-cu13 \
  nvidia-nvjitlink nvidia-nvshmem-cu13 nvidia-nvtx

SCENARIOS := circle probe descent forceps dystocia
ON_CIRCLE := circle_lab circle_pure
STUDENT := circle_honest_student
# Policies by gradients: those with a configuration of their own; environments of circle_apg.
CONFIGURED := probe_apg circle_residual_apg circle_lab_apg rail_apg honest_apg
BY_GRADIENTS := circle:Circle-v2 descent:Descent-v2 forceps:Forceps-v2 dystocia:Dystocia-v2 vacuum:Vacuum-v1
GRADIENTS := $(foreach one,$(BY_GRADIENTS),$(firstword $(subst :, ,$(one)))_apg) $(CONFIGURED)
# Those that learn with sensors whose bias somebody has calibrated away.
CALIBRATED := circle_honest_apg no_force_apg
LEARNED := $(SCENARIOS) $(ON_CIRCLE) $(GRADIENTS) $(STUDENT) $(CALIBRATED)
HONEST_RIG := --parameters examples/honest_sensors_rig.toml
POLICIES := agents/policies
# Films of docs/environments: environment, file, and the seconds that are shown; a file has less than 400 kB.
FILMS := Circle-v2:circle:2:7 Probe-v3:probe:2:7 Descent-v2:descent:3:9 Forceps-v2:forceps:0.5:6.5 Dystocia-v2:dystocia:0.5:7 \
  Vacuum-v1:vacuum:0.5:6.5 Rail-v0:rail:4:10 RailSteps-v0:rail-steps:3:10 RailStiffness-v0:rail-stiffness:7:14

.PHONY: run figure test test-slow test-all quick test-weekly portable oldest fuzz mutation soak lint npm lock audit sbom dist lint-workflows bench results pictures policies learned scratch targets page kernels docs docs-links devcontainer golden clean

# What a picture needs, and the project itself.
$(BASE): pyproject.toml packaging/requirements/base.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(PIP) $(LOCKED)/base.txt
	$(PIP) install --quiet --no-deps --no-build-isolation --no-compile --editable .
	touch $@

# PyTorch's CPU build: from where pip looks anyway, else from its own index. Where neither has one for this Python, PyPI's with CUDA.
$(TORCH): $(BASE) packaging/requirements/torch.txt
	$(PIP) $(LOCKED)/torch.txt 2>/dev/null || $(PIP) $(TORCH_CPU) $(LOCKED)/torch.txt \
	  || { echo "No CPU build of PyTorch within reach: PyPI's comes with CUDA, 2.2 GB more"; $(PIP) $(LOCKED)/torch-cuda.txt; }
	touch $@

# What a training needs besides.
$(AGENTS): $(TORCH) packaging/requirements/agents.txt
	$(PIP) $(LOCKED)/agents.txt
	touch $@

# What tests and documentation need, trainings among them: no file of it is PyTorch's, which --jobs 2 installs meanwhile.
$(PROJECT): $(BASE) packaging/requirements/project.txt
	$(PIP) $(LOCKED)/project.txt
	touch $@

$(READY): $(TORCH) $(PROJECT)
	touch $(AGENTS) $@

$(TOOLS)/.ready: packaging/requirements/tools.txt
	test -x $(TOOLS)/bin/python || python3 -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip --disable-pip-version-check --no-input $(LOCKED)/tools.txt
	touch $@

# PyTorch is installed while Fig. 4 is computed.
run: $(BASE)
	@$(MAKE) --no-print-directory --jobs 2 figure $(AGENTS)
	@echo "== 2 of 4: a residual policy on top of a controller, half a minute to two minutes"
	rm -rf $(OUT)/policy
	$(BIN)/birthsim train --config circle_quick --seed 0 --out $(OUT)/policy
	@echo "== 3 of 4: a controller from scratch, by gradients through the closed loop, some 20 s"
	rm -rf $(OUT)/scratch
	$(BIN)/birthsim train --config circle_apg --steps 300000 --seed 0 --out $(OUT)/scratch
	@echo "== 4 of 4: the paper's controller, the best one, the controller from scratch and the residual on 64 episodes that training never saw"
	$(BIN)/birthsim evaluate --controller backstepping admittance-backstepping residual:$(OUT)/scratch residual --policy $(OUT)/policy \
	  --episodes 64 --seed test --out $(OUT)/evaluation
	@echo "== What to try next"
	@echo "$(BIN)/birthsim live                                       the rig in the browser, to be pulled with the mouse"
	@echo "$(BIN)/birthsim evaluate --controller backstepping examples/pd.py:PD --out $(OUT)/mine    a controller of your own"
	@echo "$(BIN)/birthsim evaluate --controller residual --policy circle --out $(OUT)/learned       a policy trained for longer"

figure: $(BASE)
	@echo "== 1 of 4: the experiment of Fig. 4 (look at $(OUT)/figure4/figure4.png)"
	$(BIN)/birthsim figure4 --out $(OUT)/figure4

test: $(READY)
	$(BIN)/python -m tests.warming
	$(PYTEST) -m "not slow"

test-slow: $(READY)
	$(BIN)/python -m tests.warming
	$(PYTEST) -m "slow and not weekly"
	HYPOTHESIS_PROFILE=slow $(PYTEST) -m "not slow" tests/fuzz

# Both, with what they share made once, and every example of tests/fuzz tried once.
test-all: $(READY)
	$(BIN)/python -m tests.warming
	$(PYTEST) -m "(slow or not fuzz) and not weekly"
	HYPOTHESIS_PROFILE=slow $(PYTEST) -m "not slow" tests/fuzz

# Between two edits: what changed, the order of the packages, and the stored trajectories.
quick: $(READY)
	$(BIN)/ruff check --quiet .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache
	$(PYTEST) -m "not slow" tests/oracles tests/contracts tests/project/test_rooms.py

# Tests marked weekly; then each client in a virtual environment of its own, with the wheel; none is left. CLIENTS="sb3 rllib" names some.
test-weekly: $(READY)
	$(BIN)/python -m tests.warming
	$(PYTEST) -m weekly
	HYPOTHESIS_PROFILE=weekly $(PYTEST) -m "not slow" tests/fuzz
	python3 -m lab.studies.clients $(CLIENTS)

portable: $(READY)
	$(BIN)/python -m lab.studies.processors

# The oldest Numba that pyproject.toml allows, beside the installed rest; constraints.txt has the newest.
oldest: $(READY) $(OLDEST)/numba
	BIRTHSIM_PREBUILT=0 PYTHONPATH=$(CURDIR)/$(OLDEST) NUMBA_CACHE_DIR=$(CURDIR)/$(OLDEST)/cache $(BIN)/python -m lab.studies.processors here

$(OLDEST)/numba: | $(BASE)
	$(PIP) install --quiet --no-deps --target $(OLDEST) numba==0.65.0 llvmlite==0.47.0

# A full disk needs root.
kills: $(READY)
	KILLS=$${KILLS:-12} nice $(PYTEST) tests/kills

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

# What comes from npm: axe-core, with which tests look at pages, and MathJax, which draws the site's equations.
npm: $(NPM)/.ready

$(NPM)/.ready: packaging/requirements/npm/package.json packaging/requirements/npm/package-lock.json
	mkdir -p $(NPM)
	cp packaging/requirements/npm/package.json packaging/requirements/npm/package-lock.json $(NPM)
	npm ci --prefix $(NPM) --ignore-scripts --no-audit --no-fund --silent
	touch $@

# Versions are those of constraints.txt. torch.txt is kept by hand: its files are not on PyPI.
lock: $(TOOLS)/.ready
	$(LOCK)/base.txt pyproject.toml packaging/requirements/build.in
	$(LOCK)/agents.txt --extra agents $(addprefix --no-emit-package ,$(CUDA)) pyproject.toml packaging/requirements/build.in
	$(LOCK)/project.txt $(addprefix --extra ,$(EXTRAS)) $(addprefix --no-emit-package ,$(CUDA)) pyproject.toml packaging/requirements/build.in
	$(LOCK)/torch-cuda.txt packaging/requirements/torch-cuda.in
	$(LOCK)/tools.txt packaging/requirements/tools.in

# What is known against the locked versions, as PyPI tells it; --strict: a package that PyPI says nothing of fails too.
audit: $(TOOLS)/.ready
	$(TOOLS)/bin/pip-audit --strict --no-deps --disable-pip --requirement packaging/requirements/project.txt --requirement packaging/requirements/torch-cuda.txt

sbom: $(READY) $(TOOLS)/.ready
	mkdir -p $(OUT)
	$(TOOLS)/bin/python .ci/sbom.py $(BIN)/python $(OUT)/sbom.json

# A wheel and a source archive, checked as PyPI would.
dist: $(TOOLS)/.ready
	rm -rf dist
	$(TOOLS)/bin/python -m build --quiet --outdir dist .
	$(TOOLS)/bin/twine check --strict dist/*

lint-workflows: $(TOOLS)/.ready
	$(TOOLS)/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(TOOLS)/bin/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	$(TOOLS)/bin/zizmor --offline --quiet .github
	$(TOOLS)/bin/hadolint packaging/container/Containerfile
	$(TOOLS)/bin/python -c "import rattler_build as r; r.Stage0Recipe.from_file('packaging/conda/recipe.yaml').render(r.VariantConfig())"

bench: $(READY)
	$(BIN)/birthsim study speed --out $(OUT)/bench
	$(BIN)/birthsim study targets --out $(OUT)/targets

pictures: $(READY)
	$(BIN)/birthsim figure4 --out $(OUT)/figure4
	cp $(OUT)/figure4/figure4.svg $(OUT)/figure4/rig.png docs/
	printf '[mechanics]\nmass = 3.6\n[cylinder1]\ncoulomb_friction = 16.0\n[valves]\nsonic_conductance = 4.4e-9\ntime_constant = 0.0055\n[chambers]\ndead_volume = 16e-6\n[electronics]\nposition_latency = 0.008\n' > $(OUT)/lab.toml
	$(BIN)/birthsim identify --propose $(OUT)/plan.csv
	$(BIN)/birthsim identify --simulate $(OUT)/plan.csv --parameters $(OUT)/lab.toml --out $(OUT)/log.parquet
	$(BIN)/birthsim identify $(OUT)/log.parquet --out $(OUT)/rig.toml --report $(OUT)/identify
	cp $(OUT)/identify/residuals.svg docs/identify_residuals.svg
	$(BIN)/birthsim animate --env BirthSIM/Circle-v2 --controller backstepping residual --seed 3 --rate 10 --begin 2 --end 10 --out docs/circle.webp
	for film in $(FILMS); do set -- $$(echo $$film | tr : ' '); $(BIN)/birthsim animate --env BirthSIM/$$1 \
	  --controller backstepping admittance-adaptive --sensors lab --seed 1 --rate 10 --begin $$3 --end $$4 --out docs/environments/$$2.webp || exit 1; done

# Interrupted, the same command goes on. What is fresh is left as it is; birthsim study status has the seconds of each.
results: $(READY)
	$(BIN)/birthsim study renew
	$(BIN)/birthsim study render
	$(BIN)/birthsim study draw

# The student learns from teachers that are told the rig, which no controller can be.
policies: $(READY)
	for name in $(SCENARIOS) $(ON_CIRCLE) $(CONFIGURED); do \
	  $(BIN)/birthsim train --config $$name --seeds 5 --jobs 2 --out $(OUT)/training/$$name || exit 1; done
	for one in $(BY_GRADIENTS); do id=$${one#*:}; $(BIN)/birthsim train --config circle_apg \
	  --env BirthSIM/$${id%-*}Residual-$${id#*-} --seeds 5 --jobs 2 --out $(OUT)/training/$${one%:*}_apg || exit 1; done
	for name in $(CALIBRATED); do $(BIN)/birthsim train --config $$name --seeds 5 --jobs 2 \
	  --parameters examples/calibrated_sensors_rig.toml --out $(OUT)/training/$$name || exit 1; done
	$(BIN)/birthsim train --config circle_honest_told --seeds 5 --jobs 2 $(HONEST_RIG) --out $(OUT)/training/circle_honest_told
	$(BIN)/birthsim distill --teacher $(OUT)/training/circle_honest_told --seeds 5 --jobs 2 $(HONEST_RIG) \
	  --out $(OUT)/training/$(STUDENT)
	for name in $(LEARNED); do for seed in 0 1 2 3 4; do mkdir -p $(POLICIES)/$$name/seed_$$seed && \
	  cp $(OUT)/training/$$name/seed_$$seed/policy.safetensors $(OUT)/training/$$name/seed_$$seed/training.json $(POLICIES)/$$name/seed_$$seed/ || exit 1; done; done

learned: $(READY)
	$(BIN)/birthsim study learned
	$(BIN)/birthsim study by-gradients
	$(BIN)/birthsim study render
	$(BIN)/birthsim explain --policy probe --out $(OUT)/learned/explain_probe
	$(BIN)/birthsim explain --policy circle --no-pushes --out $(OUT)/learned/explain
	cp $(OUT)/learned/explain/correction.svg docs/
	cp $(OUT)/studies/learned/learning_curves.svg $(OUT)/studies/by-gradients/from_scratch.svg docs/

scratch: $(READY)
	$(BIN)/python examples/from_scratch.py --out $(OUT)/scratch

targets: $(READY)
	$(BIN)/birthsim study targets
	$(BIN)/birthsim study render

page: $(READY)
	$(BIN)/python -m birthsim_live.rig.build

# KERNELS="--check --every", as birthsim_build/kernels/__main__.py says.
kernels: $(READY)
	$(BIN)/python -m birthsim_build.kernels $(KERNELS)

# Odd input ends a process that goes on from it: without workers, the last test named is the one.
fuzz: $(READY)
	HYPOTHESIS_PROFILE=deep nice $(BIN)/python -m pytest -v --hypothesis-seed=$${SEED:-0} tests/fuzz

# mutmut leaves functions with decorators alone: in the copy those files' kernels have none, and all are plain Python. Tests that
# take long without machine code are skipped. MUTANTS="birthsim_env.physics.pneumatics.valves*" names some.
mutation: $(READY)
	test -x $(MUTMUT)/bin/mutmut || { python3 -m venv $(MUTMUT) && echo "$(CURDIR)/$(VENV)/lib/$$(ls $(VENV)/lib)/site-packages" > \
	  $(MUTMUT)/lib/$$(ls $(MUTMUT)/lib)/site-packages/project.pth && $(MUTMUT)/bin/pip install --quiet mutmut==3.8.1; }
	rm -rf $(OUT)/mutation && mkdir -p $(OUT)/mutation
	git ls-files -z | xargs -0 cp --parents --target-directory $(OUT)/mutation
	cd $(OUT)/mutation && sed -i -E '/^@(kernel|helper)$$/d' $$(sed -n '/^only_mutate/,/^]/p' pyproject.toml | grep -o '[a-z_/]*\.py')
	cd $(OUT)/mutation && BIRTHSIM_DEBUG=1 HYPOTHESIS_PROFILE=brief nice $(CURDIR)/$(MUTMUT)/bin/mutmut run --max-children 2 $(MUTANTS)
	cd $(OUT)/mutation && $(CURDIR)/$(MUTMUT)/bin/mutmut results

# A warning fails it: a page that no list names, a link or an anchor that leads nowhere, a cell that fails.
docs: $(READY) $(NPM)/.ready
	rm -rf $(OUT)/docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs $(OUT)/docs
	@echo "$(BIN)/python -m http.server -d $(OUT)/docs shows it at http://127.0.0.1:8000; opened as a file its rigs stand still"

docs-links: $(READY)
	$(BIN)/python -m sphinx --builder linkcheck --define nb_execution_mode=off docs $(OUT)/docs-links

# The same file, with paths as they are from there; git ignores it.
devcontainer:
	mkdir -p .devcontainer
	sed -e 's|"Containerfile"|"../packaging/container/Containerfile"|' -e 's|"../.."|".."|' packaging/container/devcontainer.json > .devcontainer/devcontainer.json

# Interrupted, the same command carries on.
soak: $(READY)
	$(BIN)/birthsim study soak --out $(OUT)/soak

golden: $(READY)
	$(BIN)/python -m tests.oracles.golden.fingerprints

clean:
	rm -rf $(VENV) $(OUT)
