# A thin face over CMake. `make` leaves the program at build/nebel.

BUILD ?= build
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
CONFIGURE = cmake -S . -DNEBEL_WERROR=ON
SOURCES = $(shell git ls-files '*.c' '*.h' '*.cpp')

.PHONY: all demo test bench asan lint format clean

all:
	@scripts/install_packages.sh build
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@cmake --build $(BUILD) -j $(JOBS)

demo:
	@scripts/install_packages.sh build demo
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=OFF
	@cmake --build $(BUILD) -j $(JOBS) --target nebel_tool
	@scripts/demo.sh $(BUILD)

test:
	@scripts/install_packages.sh build demo test
	@$(CONFIGURE) -B $(BUILD) -DNEBEL_BUILD_TESTS=ON
	@cmake --build $(BUILD) -j $(JOBS)
	@ctest --test-dir $(BUILD) --output-on-failure --no-tests=error -j 2

bench: all
	@$(BUILD)/nebel bench

asan:
	@scripts/install_packages.sh build demo test
	@$(CONFIGURE) -B $(BUILD)-asan -DCMAKE_BUILD_TYPE=Debug -DNEBEL_SANITIZE=ON
	@cmake --build $(BUILD)-asan -j $(JOBS)
	@ctest --test-dir $(BUILD)-asan --output-on-failure --no-tests=error -j 2

lint: all
	@scripts/install_packages.sh build test lint
	@python3 scripts/check_includes.py
	@python3 scripts/check_style.py
	@scripts/check_formulas.sh
	@scripts/check_symbols.sh $(BUILD)

format:
	@scripts/install_packages.sh lint
	@clang-format -i $(SOURCES)

clean:
	@rm -rf $(BUILD) $(BUILD)-asan
