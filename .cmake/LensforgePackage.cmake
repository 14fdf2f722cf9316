# SPDX-License-Identifier: GPL-3.0-or-later
# The installed package: after cmake --install, another project says find_package(lensforge) and links
# lensforge::design, lensforge::cam, lensforge::step or another room. lensforge_room() adds the libraries.
include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/lensforge")
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/lensforgeConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/lensforgeConfig.cmake" INSTALL_DESTINATION "${package_folder}")
write_basic_package_version_file("${CMAKE_BINARY_DIR}/lensforgeConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
    "${CMAKE_BINARY_DIR}/lensforgeConfig.cmake" "${CMAKE_BINARY_DIR}/lensforgeConfigVersion.cmake"
  DESTINATION "${package_folder}")
install(EXPORT lensforgeTargets NAMESPACE lensforge:: DESTINATION "${package_folder}")

# Headers keep their paths: "design/design_lens.h" lies in include/lensforge/design/.
install(DIRECTORY core design cam export machine
  DESTINATION "${LENSFORGE_INCLUDE_FOLDER}" FILES_MATCHING PATTERN "*.h")
