// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/command_line.h"

namespace {

/// Before the constructors of any library that is linked in: those may open files.
__attribute__((section(".preinit_array"),
               used)) void (*const kFirst)() = lensforge::app::hold_standard_descriptors;

}  // namespace

int main(int argc, char** argv) { return lensforge::app::run_main(argc, argv); }
