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
# Vectors of several numbers (core/compute/lanes.h) are never passed: everything that takes them is inlined.
target_compile_options(lensforge_options INTERFACE -Wno-psabi)
# The Python module is a shared library of the same rooms.
target_compile_options(lensforge_options INTERFACE -fPIC -fno-semantic-interposition)
# Boost 1.74 tells every build of deprecated headers that its own headers include.
target_compile_definitions(lensforge_options INTERFACE BOOST_ALLOW_DEPRECATED_HEADERS)
if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  # Clang 22 refuses the consteval functions of fmt in OpenImageIO 2.5's headers.
  target_compile_definitions(lensforge_options INTERFACE FMT_CONSTEVAL=)
  # Boost 1.74 has values beyond their enumeration's in its headers. From 20 on Clang has no such option.
  if(CMAKE_CXX_COMPILER_VERSION VERSION_LESS 20)
    target_compile_options(lensforge_options INTERFACE -Wno-enum-constexpr-conversion)
  endif()
endif()
if(LENSFORGE_WERROR)
  target_compile_options(lensforge_options INTERFACE -Werror)
endif()
if(LENSFORGE_SANITIZE)
  target_compile_options(lensforge_options INTERFACE -fsanitize=${LENSFORGE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(lensforge_options INTERFACE -fsanitize=${LENSFORGE_SANITIZE})
  # These checks stand at every access. The address sanitizer sees most of what they see, and without them a
  # file takes 28 s in place of 65 to compile, at -O2 as at -O1.
  if(LENSFORGE_SANITIZE MATCHES "address.*undefined")
    target_compile_options(lensforge_options INTERFACE
      -fno-sanitize=null,alignment,object-size,vptr,pointer-overflow)
  endif()
endif()

include(LensforgePrecompile)
include(GNUInstallDirs)
set(LENSFORGE_INCLUDE_FOLDER "${CMAKE_INSTALL_INCLUDEDIR}/lensforge")

# lensforge_install(TARGET NAME)
# Makes a library part of the installed package, as lensforge::NAME.
function(lensforge_install target name)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT lensforgeTargets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
endfunction()

# lensforge_room(NAME FOLDER SOURCES ... PUBLIC ... PRIVATE ... [DOOR ...] [HEADERS ...] [INTERNAL] [APART])
# A static library lensforge_NAME, alias lensforge::NAME, for the sources in FOLDER (relative to the
# root). Its headers are reached as "FOLDER/header.h" through a link of its own, so that only
# targets that link the room can include from it: the arrows between rooms are enforced. DOOR is a
# header beside FOLDER that comes with the room. HEADERS are precompiled beside the common ones.
# INTERNAL rooms are not installed. APART ones have files that use the same names for things of their
# own, and are never united.
function(lensforge_room name folder)
  cmake_parse_arguments(arg "INTERNAL;APART" "DOOR" "SOURCES;PUBLIC;PRIVATE;HEADERS" ${ARGN})
  add_library(lensforge_${name} STATIC ${arg_SOURCES})
  add_library(lensforge::${name} ALIAS lensforge_${name})
  target_compile_features(lensforge_${name} PUBLIC cxx_std_20)
  set(root "${CMAKE_BINARY_DIR}/rooms/${name}")
  file(REMOVE_RECURSE "${root}")  # An earlier configuration's link may stand where a folder is needed now.
  cmake_path(GET folder PARENT_PATH parent)
  file(MAKE_DIRECTORY "${root}/${parent}")
  file(CREATE_LINK "${CMAKE_SOURCE_DIR}/${folder}" "${root}/${folder}" SYMBOLIC)
  if(arg_DOOR)
    file(CREATE_LINK "${CMAKE_SOURCE_DIR}/${arg_DOOR}" "${root}/${arg_DOOR}" SYMBOLIC)
  endif()
  target_include_directories(lensforge_${name} PUBLIC
    "$<BUILD_INTERFACE:${root}>" "$<INSTALL_INTERFACE:${LENSFORGE_INCLUDE_FOLDER}>")
  target_link_libraries(lensforge_${name}
    PUBLIC ${arg_PUBLIC} PRIVATE "$<BUILD_INTERFACE:lensforge_options>" ${arg_PRIVATE})
  if(LENSFORGE_PRECOMPILED_HEADERS AND arg_HEADERS)
    target_precompile_headers(lensforge_${name} PRIVATE ${LENSFORGE_COMMON_HEADERS} ${arg_HEADERS})
  else()
    lensforge_precompile(lensforge_${name} lensforge_common_headers)
  endif()
  if(NOT arg_APART)
    lensforge_unite(lensforge_${name})
  endif()
  if(NOT arg_INTERNAL)
    lensforge_install(lensforge_${name} ${name})
  endif()
endfunction()
