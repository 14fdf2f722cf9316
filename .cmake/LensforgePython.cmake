# SPDX-License-Identifier: GPL-3.0-or-later
# The Python that the module is for. On Debian its own, which has numpy and looks where the package puts
# the module, whatever other Python comes first on the PATH.
if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python3 COMPONENTS Interpreter Development.Module REQUIRED)
find_package(pybind11 CONFIG REQUIRED)
