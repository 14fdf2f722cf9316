# SPDX-License-Identifier: GPL-3.0-or-later
# Targets for the rooms of the house: language level, warnings, include roots, installation.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}")

add_library(lensforge_options INTERFACE)
target_compile_options(lensforge_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wnon-virtual-dtor -Wold-style-cast)
# Contraction stays off so that the same source gives the same bits at every optimisation level.
target_compile_options(lensforge_options INTERFACE -ffp-contract=off -fno-math-errno)
if(LENSFORGE_WERROR)
  target_compile_options(lensforge_options INTERFACE -Werror)
endif()
if(LENSFORGE_SANITIZE)
  target_compile_options(lensforge_options INTERFACE -fsanitize=${LENSFORGE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(lensforge_options INTERFACE -fsanitize=${LENSFORGE_SANITIZE})
endif()

include(LensforgePrecompile)

# lensforge_room(NAME FOLDER SOURCES ... PUBLIC ... PRIVATE ...)
# A static library lensforge_NAME, alias lensforge::NAME, for the sources in FOLDER (relative to the
# root). Its headers are reached as "FOLDER/header.h" through a link of its own, so that only
# targets that link the room can include from it: the arrows between rooms are enforced.
function(lensforge_room name folder)
  cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(lensforge_${name} STATIC ${arg_SOURCES})
  add_library(lensforge::${name} ALIAS lensforge_${name})
  set(root "${CMAKE_BINARY_DIR}/rooms/${name}")
  cmake_path(GET folder PARENT_PATH parent)
  file(MAKE_DIRECTORY "${root}/${parent}")
  file(CREATE_LINK "${CMAKE_SOURCE_DIR}/${folder}" "${root}/${folder}" SYMBOLIC)
  target_include_directories(lensforge_${name} PUBLIC "${root}")
  target_link_libraries(lensforge_${name}
    PUBLIC ${arg_PUBLIC} PRIVATE "$<BUILD_INTERFACE:lensforge_options>" ${arg_PRIVATE})
  lensforge_precompile(lensforge_${name} lensforge_common_headers)
endfunction()
