// SPDX-License-Identifier: GPL-3.0-or-later
// Entry for libFuzzer: cmake -DCMAKE_CXX_COMPILER=clang++ -DLENSFORGE_SANITIZE=fuzzer,address, then
// build and run the target gcode_fuzzer.
#include "machine/gcode/gcode_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lensforge::fuzz_gcode(data, size);
  return 0;
}
