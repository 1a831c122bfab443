# What every target of dynmesh shares: C++20, warnings, the source root as include path, position independence
# (the Python module links core), and the sanitizer of the preset, if any.

set(DYNMESH_SANITIZE "" CACHE STRING "Sanitizers for all of dynmesh's own code, e.g. address,undefined or thread")
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # With the sloppiness that precompiled headers ask for: nothing here writes the time into a program.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CCACHE_PROGRAM})
endif()

find_package(Threads REQUIRED)

# Options of one target; not for generated code, whose warnings are not ours.
function(dynmesh_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_EXTENSIONS OFF)
  target_include_directories(${target} PUBLIC ${PROJECT_SOURCE_DIR})
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    target_compile_options(${target} PRIVATE -Wthread-safety -Werror=thread-safety)
  endif()
  if(DYNMESH_SANITIZE)
    target_compile_options(${target} PUBLIC -fsanitize=${DYNMESH_SANITIZE} -fno-sanitize-recover=all
                                            -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${DYNMESH_SANITIZE})
  endif()
endfunction()

# dynmesh_library(name SOURCES a.cc b.cc DEPS target ...): a static library of the project.
function(dynmesh_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC ${ARG_DEPS} PRIVATE ${ARG_PRIVATE_DEPS})
  dynmesh_compile_options(${name})
endfunction()

# dynmesh_test(name SOURCES a_test.cc DEPS target ...): a GoogleTest binary, run by ctest as one test. It is compiled
# with little optimisation, since the work is done by the libraries. The first test compiles the headers below, the
# others reuse them, for which all are compiled as if they had threads; only headers of other projects, so that an edit
# of ours recompiles no more than it must.
function(dynmesh_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;DEPS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} GTest::gmock GTest::gtest_main)
  dynmesh_compile_options(${name})
  target_compile_options(${name} PRIVATE -Og -pthread)
  target_link_options(${name} PRIVATE -pthread)
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
  get_property(first_test GLOBAL PROPERTY DYNMESH_FIRST_TEST)
  if(first_test)
    target_precompile_headers(${name} REUSE_FROM ${first_test})
  else()
    target_precompile_headers(${name} PRIVATE
      <gmock/gmock.h> <gtest/gtest.h> <algorithm> <map> <random> <set> <string> <thread> <vector>
      <absl/container/btree_set.h> <absl/container/flat_hash_map.h> <absl/functional/function_ref.h>
      <absl/status/statusor.h> <absl/strings/str_cat.h> <absl/types/span.h>)
    set_property(GLOBAL PROPERTY DYNMESH_FIRST_TEST ${name})
  endif()
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
endfunction()
