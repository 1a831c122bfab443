# Two commands do everything on a bare Debian 12: `make demo` and `make test`. Each installs what it needs from
# Debian's packages, builds and runs; the second time it is quick.

JOBS ?= $(shell nproc)

.PHONY: help demo test configure sanitize asan tsan bench torture image-test clean

help:
	@echo "make demo [MESH=path]  set up, build, and drag a hole through a real mesh with four followers"
	@echo "make test              set up, build, and run all tests"
	@echo "make sanitize          the tests under AddressSanitizer + UBSan, and core under ThreadSanitizer"
	@echo "make bench [MESHES=dir] time core against flat arrays and other libraries (quiet machine, 20 minutes)"
	@echo "make torture           kill a daemon 200 times while edits stream in; nothing may be lost"
	@echo "make image-test        build the container image and make one edit through it"
	@echo "make clean             remove build/"

demo: configure
	@scripts/setup.sh demo
	@cmake --build --preset dev -j $(JOBS) --target dynmeshd dynmesh_python
	@MESH="$(MESH)" scripts/demo.sh

test: configure
	@cmake --build --preset dev -j $(JOBS)
	@ctest --preset dev -j $(JOBS)

configure:
	@scripts/setup.sh build test
	@cmake --preset dev > /dev/null

sanitize: asan tsan

asan:
	@$(call sanitize_with,asan-ubsan)

tsan:
	@$(call sanitize_with,tsan)

define sanitize_with
scripts/setup.sh build test && cmake --preset $(1) > /dev/null && \
cmake --build --preset $(1) -j $(JOBS) && ctest --preset $(1) -j $(JOBS)
endef

bench:
	@scripts/setup.sh build bench demo
	@MESHES="$(MESHES)" tests/bench/run.sh

torture: configure
	@cmake --build --preset dev -j $(JOBS) --target dynmeshd dynmesh_python
	@DYNMESH_TORTURE_KILLS=200 ctest --preset dev -R python_test_torture

image-test: configure
	@cmake --build --preset dev -j $(JOBS) --target dynmesh_python
	@docker/smoke.sh

clean:
	@rm -rf build
