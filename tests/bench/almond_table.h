// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "bench/markdown_table.h"
#include "core/compute/executor.h"

namespace lensforge::bench {

/// Radar cross-sections of the NASA almond against those of problem set III-A of the Austin RCS
/// Benchmark Suite, whose files (meas.m1_rcs.III.A.s1.fx3.V.txt and the like) lie in `folder`: the
/// suite's error measure, the mean over azimuth of the absolute difference in dB, of levels cut off
/// 80 dB below the largest one.
/// @throw InputError if a file is missing or not as described.
MarkdownTable almond_table(const std::filesystem::path& folder, const Executor& executor);

}  // namespace lensforge::bench
