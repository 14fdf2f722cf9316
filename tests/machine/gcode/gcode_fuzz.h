// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

namespace lensforge {

/// Reads, splits and runs any bytes as a program in every dialect, for fuzzers and for tests.
/// Aborts (LF_CHECK) where something refused or accepted contradicts the reader's promises.
/// @return lines that passed before the end or the first refusal.
std::int64_t fuzz_gcode(const std::uint8_t* data, std::size_t size);

}  // namespace lensforge
