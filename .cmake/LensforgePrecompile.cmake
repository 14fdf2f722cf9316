# SPDX-License-Identifier: GPL-3.0-or-later
# What makes whole builds fast: precompiled headers, and files of a target compiled several at a time.

# Two thirds of the time of a build go into reading headers, Eigen's and the
# standard library's above all (290 files of the command: 12.5 processor minutes without, 8.8 with).

# ccache saves more and does not go along with either, so they are off where a launcher is set.
set(whole_builds ON)
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(whole_builds OFF)
endif()
option(LENSFORGE_PRECOMPILED_HEADERS "Precompile the headers of Eigen and the standard library" ${whole_builds})
option(LENSFORGE_UNITY "Compile up to eight files of a target as one" ${whole_builds})

set(LENSFORGE_COMMON_HEADERS
  <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <memory> <optional> <span>
  <stop_token> <string> <vector> <Eigen/Core> <Eigen/Geometry>)

# lensforge_unite(TARGET)
# Templates that several files instantiate, Eigen's and GoogleMock's, are then compiled once: 101 processor
# seconds become 43 for the tests of export, 69 become 36 for design/transport.
function(lensforge_unite target)
  if(LENSFORGE_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    # Each of the files is the main one of its own types.
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()

# lensforge_precompiled_headers(NAME HEADERS ... LINK ...)
# An object library NAME that compiles nothing but its precompiled headers, for targets that link the
# same options.
function(lensforge_precompiled_headers name)
  cmake_parse_arguments(arg "" "" "HEADERS;LINK" ${ARGN})
  set(source "${CMAKE_BINARY_DIR}/${name}.cpp")
  file(CONFIGURE OUTPUT "${source}" CONTENT "")
  add_library(${name} OBJECT "${source}")
  target_link_libraries(${name} PRIVATE ${arg_LINK} lensforge_options)
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
endfunction()

# lensforge_precompile(TARGET FROM)
# Lets a target read its headers from FROM, a target of lensforge_precompiled_headers().
function(lensforge_precompile target from)
  if(LENSFORGE_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
endfunction()

if(LENSFORGE_PRECOMPILED_HEADERS)
  # GCC 12 takes moved strings for arrays that are written beyond their end. In headers of the standard
  # library it keeps that to itself, but not once they are precompiled.
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(lensforge_options INTERFACE
      -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
    # Under sanitizers it does not see that <regex> sets what it moves.
    if(LENSFORGE_SANITIZE)
      target_compile_options(lensforge_options INTERFACE -Wno-maybe-uninitialized)
    endif()
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    # So does Clang with what that library itself uses although it is deprecated.
    target_compile_options(lensforge_options INTERFACE -Wno-deprecated-declarations)
  endif()
  find_package(Eigen3 3.4 REQUIRED)
  lensforge_precompiled_headers(lensforge_common_headers
    HEADERS ${LENSFORGE_COMMON_HEADERS} LINK Eigen3::Eigen)
endif()
