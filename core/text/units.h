// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace lensforge {

/// Reads a length such as "100", "100mm", "10cm", "0.1m", "4in" or "250um", spaces allowed before
/// the unit; millimetres without one.
/// @param name  name of the value in the error, e.g. "--width".
/// @return millimetres. @throw InputError unless it is a finite number with a known unit or none.
double parse_length_mm(std::string_view text, const std::string& name);

}  // namespace lensforge
