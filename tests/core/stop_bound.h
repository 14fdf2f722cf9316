// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>

namespace lensforge::testing {

/// A stop takes about a second on idle cores. This bound, for cores that other tests share and for
/// sanitizers, only tells it from work that was waited for, which would take 20 s and more.
inline constexpr std::chrono::seconds kStopBound{10};

}  // namespace lensforge::testing
