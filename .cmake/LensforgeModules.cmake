# SPDX-License-Identifier: GPL-3.0-or-later
# Modules: shared libraries that programs load when they first need them, since what they link, some 230
# libraries, takes 0.2 s to load. See core/sandbox/module.h.
set(LENSFORGE_MODULE_FOLDER "${CMAKE_INSTALL_LIBDIR}/lensforge")

# The sanitizers' runtime calls dlopen() in place of the program, whose RUNPATH then does not count; RPATH does.
if(LENSFORGE_SANITIZE)
  target_link_options(lensforge_options INTERFACE LINKER:--disable-new-dtags)
endif()

# lensforge_module(NAME ROOM)
# The module lensforge-NAME.so: the code of a room and all that it needs. It exports lensforge_NAME() and
# hides everything else, so that its copy of core stays apart from the program's.
function(lensforge_module name room)
  set(target lensforge_${name}_module)
  set(stem "${CMAKE_BINARY_DIR}/${target}")
  file(CONFIGURE OUTPUT "${stem}.cpp" CONTENT "")
  file(CONFIGURE OUTPUT "${stem}.map" CONTENT "{ global: lensforge_${name}; local: *; };\n")
  add_library(${target} MODULE "${stem}.cpp")
  target_link_libraries(${target} PRIVATE ${room} lensforge_options)
  target_link_options(${target} PRIVATE
    "LINKER:--undefined=lensforge_${name}" "LINKER:--version-script=${stem}.map"
    LINKER:-z,defs LINKER:--as-needed)
  set_target_properties(${target} PROPERTIES
    PREFIX "" OUTPUT_NAME lensforge-${name} SUFFIX .so
    LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}" LINK_DEPENDS "${stem}.map" BUILD_RPATH "")
  set_property(GLOBAL APPEND PROPERTY LENSFORGE_MODULES ${target})
  install(TARGETS ${target} LIBRARY DESTINATION "${LENSFORGE_MODULE_FOLDER}" COMPONENT command)
  if(LENSFORGE_PYTHON)  # Each component works alone.
    install(TARGETS ${target} LIBRARY DESTINATION "${LENSFORGE_MODULE_FOLDER}" COMPONENT python)
  endif()
endfunction()

# lensforge_finds_modules(TARGET FOLDER)
# Lets a program that is installed in FOLDER find the modules, wherever the installation is moved.
function(lensforge_finds_modules target folder)
  cmake_path(ABSOLUTE_PATH folder BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}")
  file(RELATIVE_PATH way "${folder}" "${CMAKE_INSTALL_FULL_LIBDIR}/lensforge")
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${way}")
endfunction()

# lensforge_order_modules(FOLDER)
# Builds the modules before the programs of a folder and of those in it, and lets these programs find them in
# the build folder, wherever that is moved.
function(lensforge_order_modules folder)
  get_property(modules GLOBAL PROPERTY LENSFORGE_MODULES)
  get_property(targets DIRECTORY "${folder}" PROPERTY BUILDSYSTEM_TARGETS)
  list(REMOVE_ITEM targets ${modules})
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "EXECUTABLE")
      get_target_property(place ${target} RUNTIME_OUTPUT_DIRECTORY)
    elseif(type STREQUAL "MODULE_LIBRARY")
      get_target_property(place ${target} LIBRARY_OUTPUT_DIRECTORY)
    else()
      continue()
    endif()
    file(RELATIVE_PATH way "${place}" "${CMAKE_BINARY_DIR}")
    set_property(TARGET ${target} APPEND PROPERTY BUILD_RPATH "$ORIGIN/${way}")
    add_dependencies(${target} ${modules})
  endforeach()
  get_property(folders DIRECTORY "${folder}" PROPERTY SUBDIRECTORIES)
  foreach(inner IN LISTS folders)
    lensforge_order_modules("${inner}")
  endforeach()
endfunction()
