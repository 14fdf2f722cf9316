# SPDX-License-Identifier: GPL-3.0-or-later
# CUDA, where nvcc is found: sets LENSFORGE_HAS_CUDA and offers lensforge_cuda_sources().

option(LENSFORGE_CUDA "Build for NVIDIA GPUs too, where nvcc is found" ON)
option(LENSFORGE_CUDA_FMA "Let the GPU contract a·b + c; without, it rounds as the CPU does" OFF)
set(LENSFORGE_HAS_CUDA OFF CACHE INTERNAL "GPU code is built")
if(NOT LENSFORGE_CUDA)
  return()
endif()

find_program(LENSFORGE_NVCC nvcc HINTS "$ENV{CUDA_PATH}/bin" /usr/local/cuda/bin)
mark_as_advanced(LENSFORGE_NVCC)
if(LENSFORGE_NVCC AND NOT CMAKE_CUDA_COMPILER)
  set(CMAKE_CUDA_COMPILER "${LENSFORGE_NVCC}")
endif()
if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
  # A build from source is for the GPU of its machine. Without one, PTX for Turing and later shows that all
  # GPU code compiles and links; machine code of five generations takes many times as long (ptxas).
  execute_process(COMMAND nvidia-smi -L RESULT_VARIABLE gpu_missing OUTPUT_QUIET ERROR_QUIET)
  if(gpu_missing)
    set(CMAKE_CUDA_ARCHITECTURES 75-virtual)
  else()
    set(CMAKE_CUDA_ARCHITECTURES native)
  endif()
endif()
include(CheckLanguage)
check_language(CUDA)
if(NOT CMAKE_CUDA_COMPILER)
  message(STATUS "No nvcc: building for the CPU alone")
  return()
endif()
enable_language(CUDA)
find_package(CUDAToolkit 12.0)
if(NOT CUDAToolkit_FOUND OR NOT TARGET CUDA::cufft)
  message(STATUS "No CUDA runtime or cuFFT of version 12 or later: building for the CPU alone")
  return()
endif()
set(LENSFORGE_HAS_CUDA ON CACHE INTERNAL "GPU code is built")
if(NOT DEFINED CMAKE_CUDA20_STANDARD_COMPILE_OPTION)  # CMake 3.25 does not know it.
  set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
  set(CMAKE_CUDA20_EXTENSION_COMPILE_OPTION -std=c++20)
endif()
set(CMAKE_CUDA_STANDARD 20)
set(CMAKE_CUDA_STANDARD_REQUIRED ON)
set(CMAKE_CUDA_EXTENSIONS OFF)
set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
message(STATUS "GPU: CUDA ${CUDAToolkit_VERSION}, architectures ${CMAKE_CUDA_ARCHITECTURES}")

# Options of .cu files; LENSFORGE_CUDA tells all code that is built beside them. 20012: Eigen 3.4 marks functions
# that need no mark. Constexpr functions of the standard library (std::array, std::span) may run on the device.
add_library(lensforge_cuda_options INTERFACE)
target_compile_definitions(lensforge_cuda_options INTERFACE LENSFORGE_CUDA)
target_compile_options(lensforge_cuda_options INTERFACE
  --expt-relaxed-constexpr -diag-suppress=20012
  -Xcompiler=-fPIC,-Wall,-Wextra,-Wshadow,-Wnon-virtual-dtor,-ffp-contract=off,-fno-math-errno)
if(NOT LENSFORGE_CUDA_FMA)
  target_compile_options(lensforge_cuda_options INTERFACE -fmad=false)
endif()
if(LENSFORGE_WERROR)
  target_compile_options(lensforge_cuda_options INTERFACE
    -Werror=all-warnings,cross-execution-space-call -Xcompiler=-Werror)
endif()

# lensforge_cuda_sources(ROOM SOURCES ... [LINK ...])
# Adds .cu files to a room. They form a library of their own, because they do not take the options of
# the C++ files. The room's C++ files keep their options too, so that turning the GPU on rebuilds
# none of them; those that have to know of it are named in lensforge_cuda_callers().
function(lensforge_cuda_sources room)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_library(lensforge_${room}_cuda OBJECT ${arg_SOURCES})
  get_target_property(includes lensforge_${room} INCLUDE_DIRECTORIES)
  get_target_property(links lensforge_${room} INTERFACE_LINK_LIBRARIES)
  target_include_directories(lensforge_${room}_cuda PRIVATE ${includes})
  target_link_libraries(lensforge_${room}_cuda
    PRIVATE ${links} lensforge_cuda_options CUDA::cudart_static ${arg_LINK})
  target_sources(lensforge_${room} PRIVATE $<TARGET_OBJECTS:lensforge_${room}_cuda>)
  target_link_libraries(lensforge_${room} PRIVATE "$<LINK_ONLY:CUDA::cudart_static>" ${arg_LINK})
endfunction()

# lensforge_cuda_callers(SOURCES ...)
# C++ files that call what .cu files or CUDA's own library offer.
function(lensforge_cuda_callers)
  set_source_files_properties(${ARGN} PROPERTIES
    COMPILE_DEFINITIONS LENSFORGE_CUDA
    COMPILE_OPTIONS "-isystem;${CUDAToolkit_INCLUDE_DIRS}")
endfunction()
