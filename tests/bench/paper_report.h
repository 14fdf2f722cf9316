// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "bench/paper_result.h"

namespace lensforge::bench {

/// The machine in one line: processor, cores, memory.
std::string machine_line();

/// The tables in Markdown, as far as there are results for them: Table 1 (settings and error of the
/// program's own rendering), Table 2 (by ray trace), the effort, the ablation in the form of
/// Fig. 10, and `machine` below. Errors are in thousandths of display white.
std::string paper_report(const std::vector<PaperResult>& results, const std::string& machine);

/// One line about a row that was just run.
std::string progress_line(const PaperResult& result);

}  // namespace lensforge::bench
