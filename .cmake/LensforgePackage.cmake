# SPDX-License-Identifier: GPL-3.0-or-later
# The installed package: after cmake --install, another project says find_package(lensforge) and links
# lensforge::design, lensforge::cam, lensforge::step or another room. lensforge_room() adds the libraries.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/lensforge")
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/lensforgeConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/lensforgeConfig.cmake" INSTALL_DESTINATION "${package_folder}"
  PATH_VARS LENSFORGE_MODULE_FOLDER)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/lensforgeConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
    "${CMAKE_BINARY_DIR}/lensforgeConfig.cmake" "${CMAKE_BINARY_DIR}/lensforgeConfigVersion.cmake"
  DESTINATION "${package_folder}")
install(EXPORT lensforgeTargets NAMESPACE lensforge:: DESTINATION "${package_folder}")

# The doors of the rooms, and the headers that they include, are installed; all others are private. Headers keep
# their paths: "design/design.h" lies in include/lensforge/design/.
set(LENSFORGE_DOORS
  core/lens.h core/picture.h design/design.h design/render.h design/reflect.h
  cam/cam.h machine/send.h machine/gcode.h export/export.h)
set(public_headers "")
set(unread ${LENSFORGE_DOORS})
while(unread)
  list(POP_FRONT unread header)
  list(APPEND public_headers "${header}")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${header}")
  file(STRINGS "${header}" includes REGEX "^#include \"")
  list(TRANSFORM includes REPLACE "^#include \"(.*)\".*" "\\1")
  list(APPEND unread ${includes})
  list(REMOVE_DUPLICATES unread)
  list(REMOVE_ITEM unread ${public_headers})
endwhile()
list(LENGTH public_headers public_count)
if(public_count GREATER 60)
  message(FATAL_ERROR "${public_count} headers would be installed, and at most 60 may be: \
doors include data, not algorithms")
endif()
foreach(header IN LISTS public_headers)
  cmake_path(GET header PARENT_PATH folder)
  install(FILES "${header}" DESTINATION "${LENSFORGE_INCLUDE_FOLDER}/${folder}")
endforeach()

# cpack makes a Debian package of the command, and of the Python module where it is built; what they
# need is found by dpkg-shlibdeps. The module is for Debian's own Python, which the command is not.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lensforge)
set(CPACK_PACKAGE_CONTACT "lensforge developers")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL command debian)
if(LENSFORGE_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), \
python3 (<< ${Python3_VERSION_MAJOR}.${next_python}), python3-numpy")
endif()
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
include(CPack)
