# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DBUILD=... -DEXAMPLES=... -DCOMPILER=... -DLAUNCHER=... -DSANITIZE=... -P outside_project.cmake
# Fails unless a project that knows nothing but the installed package configures, builds and runs.
set(work "${BUILD}/tests/outside_project")
set(prefix "${work}/prefix")
file(REMOVE_RECURSE "${work}")

# run(COMMAND ...): stops with its output if it fails.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}\nended with ${status}:\n${output}")
  endif()
endfunction()

# require(FILE ...): stops unless all exist and are not empty.
function(require)
  foreach(file IN LISTS ARGN)
    if(NOT EXISTS "${file}")
      message(FATAL_ERROR "${file}: was not written")
    endif()
    file(SIZE "${file}" size)
    if(size EQUAL 0)
      message(FATAL_ERROR "${file}: is empty")
    endif()
  endforeach()
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")
require("${prefix}/bin/lensforge" "${prefix}/include/lensforge/design/design.h")
run("${prefix}/bin/lensforge" --version)

set(flags "")
if(SANITIZE)
  set(flags "-fsanitize=${SANITIZE}")
endif()
run("${CMAKE_COMMAND}" -S "${EXAMPLES}" -B "${work}/build" -G Ninja "-DCMAKE_PREFIX_PATH=${prefix}"
  "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}"
  "-DCMAKE_CXX_FLAGS=${flags}" -DCMAKE_BUILD_TYPE=Debug)
run("${CMAKE_COMMAND}" --build "${work}/build")

run("${work}/build/design_and_export" "${BUILD}/pictures/rings.png" "${work}/lens")
require("${work}/lens/lens.json" "${work}/lens/surface.ply" "${work}/lens/lens.stl")

# The installation works wherever it is moved; without its modules a command names the one that is missing.
file(RENAME "${prefix}" "${work}/moved")
run("${work}/moved/bin/lensforge" info "${work}/lens")
file(GLOB_RECURSE modules "${work}/moved/*/lensforge-*.so")
list(LENGTH modules count)
if(NOT count EQUAL 2)
  message(FATAL_ERROR "two modules are installed, not: ${modules}")
endif()
file(REMOVE ${modules})
execute_process(COMMAND "${work}/moved/bin/lensforge" info "${work}/lens"
  RESULT_VARIABLE status ERROR_VARIABLE text)
if(NOT status EQUAL 1 OR NOT text MATCHES "^lensforge: the file lensforge-pictures.so is missing[^\n]*\n$")
  message(FATAL_ERROR "without modules a command ends with ${status}: ${text}")
endif()
file(REMOVE_RECURSE "${work}")
