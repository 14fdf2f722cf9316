// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

namespace lensforge {

/// A number with so many decimals, independent of the locale.
std::string fixed_text(double value, int decimals);

/// A word and a whole number behind it.
std::string numbered(const std::string& word, std::int64_t number);

/// Three of them with commas between.
std::string fixed_text(const Eigen::Vector3d& value, int decimals);

}  // namespace lensforge
