// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

namespace lensforge {

/// A number as an index of the standard library's containers. @pre value ≥ 0
constexpr std::size_t index_of(std::int64_t value) { return static_cast<std::size_t>(value); }

}  // namespace lensforge
