// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Reads numbers that are separated by commas, such as "50,50,-600"; spaces around them are
/// allowed.
/// @param name  name of the value in the error, e.g. "--image-offset".
/// @throw InputError unless there are `count` finite numbers.
std::vector<double> parse_numbers(std::string_view text, const std::string& name, int count);

/// Reads a length such as "100", "100mm", "10cm", "0.1m", "4in" or "250um", spaces allowed before
/// the unit; millimetres without one.
/// @param name  name of the value in the error, e.g. "--width".
/// @return millimetres. @throw InputError unless it is a finite number with a known unit or none.
double parse_length_mm(std::string_view text, const std::string& name);

/// The shortest text from which parse_numbers() reads the same numbers.
std::string numbers_text(std::span<const double> numbers);

}  // namespace lensforge
