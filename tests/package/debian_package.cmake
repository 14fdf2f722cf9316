# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DBUILD=... -DPYTHON=... -P debian_package.cmake
# Fails unless cpack makes a Debian package whose content, in an empty root, designs a lens: the command,
# and where it is built the Python module.
foreach(tool dpkg dpkg-deb dpkg-shlibdeps file)
  find_program(found_${tool} ${tool})
  if(NOT found_${tool})
    message("skipped: ${tool} is not installed")
    return()
  endif()
endforeach()
set(work "${BUILD}/debian_package")
set(root "${work}/root")
file(REMOVE_RECURSE "${work}")
file(MAKE_DIRECTORY "${root}")

# run(COMMAND ...): stops with its output if it fails; leaves what it printed in `output`.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}\nended with ${status}:\n${text}")
  endif()
  set(output "${text}" PARENT_SCOPE)
endfunction()

# Quickly packed: how small the package is does not matter here.
cmake_path(GET CMAKE_COMMAND PARENT_PATH programs)
run("${programs}/cpack" --config "${BUILD}/CPackConfig.cmake" -B "${work}"
  -D CPACK_DEBIAN_COMPRESSION_TYPE=none)
file(GLOB packages "${work}/*.deb")
list(LENGTH packages count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "cpack left ${count} packages: ${packages}")
endif()

run(dpkg-deb --field "${packages}" Depends)
foreach(library libopenimageio librsvg libocct libc6 libstdc++6 libtbb)
  string(FIND "${output}" "${library}" found)
  if(found EQUAL -1)
    message(FATAL_ERROR "the package does not depend on ${library}: ${output}")
  endif()
endforeach()

run(dpkg -x "${packages}" "${root}")
foreach(name bin/lensforge lib/lensforge/lensforge-pictures.so lib/lensforge/lensforge-solids.so
    share/man/man1/lensforge.1
    share/bash-completion/completions/lensforge share/zsh/vendor-completions/_lensforge
    share/fish/vendor_completions.d/lensforge.fish)
  if(NOT EXISTS "${root}/usr/${name}")
    message(FATAL_ERROR "the package has no /usr/${name}")
  endif()
endforeach()
if(EXISTS "${root}/usr/include" OR EXISTS "${root}/usr/lib/liblensforge_core.a")
  message(FATAL_ERROR "the package has files for developers")
endif()

run("${root}/usr/bin/lensforge" --version)
run("${root}/usr/bin/lensforge" design "${BUILD}/pictures/rings.png" --out "${work}/lens"
  --pixels 16 --rounds 1 --quiet)
run("${root}/usr/bin/lensforge" export "${work}/lens" --out "${work}/lens.step" --quiet)
run("${root}/usr/bin/lensforge" info "${work}/lens")
if(PYTHON)
  set(modules "${root}/usr/lib/python3/dist-packages")
  if(NOT EXISTS "${modules}/lensforge/py.typed")
    message(FATAL_ERROR "the package has no Python module")
  endif()
  run("${CMAKE_COMMAND}" -E env "PYTHONPATH=${modules}" "${PYTHON}" -B -c
    "import lensforge\nprint(lensforge.__file__, lensforge.Lens('${work}/lens'))")
  string(FIND "${output}" "${modules}/lensforge/__init__.py" found)
  if(found EQUAL -1)
    message(FATAL_ERROR "the module does not come from the package: ${output}")
  endif()
endif()
file(REMOVE_RECURSE "${work}")
