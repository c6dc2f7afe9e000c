# A thin face over CMake. `make` leaves the program at build/nebel; `make V=1` shows every step.

BUILD ?= build
V ?= 0
# Of the sanitizers: options of cmake, and those of ctest that choose among the tests: make asan CHOSEN='-R grid'.
OPTIONS ?=
CHOSEN ?=
# A compiler that is newer than this source may have new warnings: they stop CI, not a first build.
WERROR ?= $(if $(CI),ON,OFF)
# As many as make -j says, else as many as there are processors.
JOBS ?= $(or $(patsubst -j%,%,$(filter -j%,$(MAKEFLAGS))),$(shell nproc 2>/dev/null || echo 2))
SOURCES = $(shell git ls-files '*.c' '*.h' '*.cpp')
MODELS = examples/scenes/models/landscape.png examples/scenes/models/planet.obj examples/scenes/models/gates.gltf \
	examples/scenes/models/hall.obj examples/scenes/models/rooms.obj examples/scenes/models/smoke.raw \
	examples/scenes/models/tree.glb

ifeq ($(V),0)
CONFIGURE = cmake -S . -DNEBEL_WERROR=$(WERROR) -DCMAKE_RULE_MESSAGES=OFF -DCMAKE_TARGET_MESSAGES=OFF >/dev/null
else
CONFIGURE = cmake -S . -DNEBEL_WERROR=$(WERROR) -DCMAKE_RULE_MESSAGES=ON -DCMAKE_TARGET_MESSAGES=ON
endif
# A make below has processes of its own to share out: it must not look for those of this one.
COMPILE = MAKEFLAGS=--no-print-directory cmake --build

# What `make test` tries of what the suites count out; test-all tries all of it.
SCALE ?= 0.1

.PHONY: all demo pictures film test test-all tests report bench asan lint format clean

all: $(MODELS)
	@scripts/install_packages.sh build
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@$(COMPILE) $(BUILD) -j $(JOBS)
	@echo "nebel: the program is $(BUILD)/nebel"

demo: $(MODELS)
	@scripts/install_packages.sh build demo
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@$(COMPILE) $(BUILD) -j $(JOBS) --target nebel_tool
	@scripts/demo.sh $(BUILD) morning-mist sun-shafts ground-fog clearing gates street-lamps planet-day terminator

pictures: all
	@scripts/demo.sh $(BUILD)

film: all
	@mkdir -p $(BUILD)/demo
	@$(BUILD)/nebel render examples/scenes/wisps.json -o $(BUILD)/demo/wisps.webp --frames 0-35 --fps 12 --size 384x216 --samples 1
	@$(BUILD)/nebel render examples/scenes/sunset.json -o $(BUILD)/demo/sunset.webp --frames 0-35 --fps 12 --size 384x216 --samples 1

# A first opinion in minutes: all that is not slow, at reduced counts.
test: tests
	@NEBEL_TEST_SCALE=$(SCALE) ctest --test-dir $(BUILD) --output-on-failure --no-tests=error -j 2 -LE slow --output-junit $(abspath $(BUILD))/tests.xml

test-all: tests
	@ctest --test-dir $(BUILD) --output-on-failure --no-tests=error -j 2 --output-junit $(abspath $(BUILD))/tests.xml

tests: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=ON
	@$(COMPILE) $(BUILD) -j $(JOBS)

report: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=ON
	@$(COMPILE) $(BUILD) -j $(JOBS) --target nebel_test_gl
	@mkdir -p $(BUILD)/report
	@NEBEL_REPORT=$(BUILD)/report $(BUILD)/tests/nebel_test_gl test_picture_gl
	@echo "nebel: the report is $(BUILD)/report/index.html"

bench: all
	@$(BUILD)/nebel bench

asan: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building with sanitizers"
	@$(CONFIGURE) -B $(BUILD)-asan -DCMAKE_BUILD_TYPE=Debug -DNEBEL_SANITIZE=ON $(OPTIONS)
	@$(COMPILE) $(BUILD)-asan -j $(JOBS)
	@NEBEL_TEST_SCALE=$(SCALE) ctest --test-dir $(BUILD)-asan --output-on-failure --no-tests=error -j 2 $(CHOSEN)

lint: all
	@scripts/install_packages.sh build test lint
	@python3 scripts/check_includes.py
	@python3 scripts/check_tags.py
	@python3 scripts/check_style.py
	@clang-format --dry-run -Werror $(SOURCES)
	@scripts/check_formulas.sh
	@scripts/check_shaders.sh
	@scripts/check_symbols.sh $(BUILD)

format:
	@scripts/install_packages.sh lint
	@clang-format -i $(SOURCES)

clean:
	@rm -rf $(BUILD) $(BUILD)-asan

# What example scenes need and what is made, not kept.
examples/scenes/models/%.png: examples/make_%.py
	@scripts/install_packages.sh example
	@python3 $< $@

examples/scenes/models/%.gltf: examples/make_%.py
	@scripts/install_packages.sh example
	@python3 $< $@

examples/scenes/models/%.obj: examples/make_%.py
	@scripts/install_packages.sh example
	@python3 $< $@

examples/scenes/models/%.glb: examples/make_%.py
	@scripts/install_packages.sh example
	@python3 $< $@

examples/scenes/models/%.raw: examples/make_%.py
	@scripts/install_packages.sh example
	@python3 $< $@
