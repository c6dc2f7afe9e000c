# A thin face over CMake. `make` leaves the program at build/nebel; `make V=1` shows every step.

BUILD ?= build
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
V ?= 0
SOURCES = $(shell git ls-files '*.c' '*.h' '*.cpp')
MODELS = examples/scenes/models/landscape.png examples/scenes/models/planet.obj examples/scenes/models/gates.gltf \
	examples/scenes/models/hall.obj examples/scenes/models/rooms.obj

MAKEFLAGS += --no-print-directory
ifeq ($(V),0)
CONFIGURE = cmake -S . -DNEBEL_WERROR=ON -DCMAKE_RULE_MESSAGES=OFF -DCMAKE_TARGET_MESSAGES=OFF >/dev/null
else
CONFIGURE = cmake -S . -DNEBEL_WERROR=ON -DCMAKE_RULE_MESSAGES=ON -DCMAKE_TARGET_MESSAGES=ON
endif

.PHONY: all demo test report bench asan lint format clean

all: $(MODELS)
	@scripts/install_packages.sh build
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@cmake --build $(BUILD) -j $(JOBS)
	@echo "nebel: the program is $(BUILD)/nebel"

demo: $(MODELS)
	@scripts/install_packages.sh build demo
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@cmake --build $(BUILD) -j $(JOBS) --target nebel_tool
	@scripts/demo.sh $(BUILD)

test: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=ON
	@cmake --build $(BUILD) -j $(JOBS)
	@ctest --test-dir $(BUILD) --output-on-failure --no-tests=error -j 2

report: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building"
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=ON
	@cmake --build $(BUILD) -j $(JOBS) --target test_picture_gl
	@mkdir -p $(BUILD)/report
	@NEBEL_REPORT=$(BUILD)/report $(BUILD)/tests/test_picture_gl
	@echo "nebel: the report is $(BUILD)/report/index.html"

bench: all
	@$(BUILD)/nebel bench

asan: $(MODELS)
	@scripts/install_packages.sh build demo test
	@echo "nebel: building with sanitizers"
	@$(CONFIGURE) -B $(BUILD)-asan -DCMAKE_BUILD_TYPE=Debug -DNEBEL_SANITIZE=ON
	@cmake --build $(BUILD)-asan -j $(JOBS)
	@ctest --test-dir $(BUILD)-asan --output-on-failure --no-tests=error -j 2

lint: all
	@scripts/install_packages.sh build test lint
	@python3 scripts/check_includes.py
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
