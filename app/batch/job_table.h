// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lensforge::app {

/// A row of the table: what was asked for and what came of it.
struct TableJob {
  nlohmann::json job;  ///< BatchJob::json()
  std::string status;  ///< status_word()
  std::string message;
  nlohmann::json record;  ///< job_record()
};

/// The jobs as CSV (RFC 4180): name, status, message, seconds, then every option that any job has
/// ("design.focal") and every number, word and truth value of the commands' results
/// ("design.metrics.smooth.mae"), empty where a job has none. What a command repeats of how it was
/// called is left out.
std::string job_table(const std::vector<TableJob>& jobs);

/// Whether the file begins as a table of jobs does.
bool is_job_table(const std::filesystem::path& file);

}  // namespace lensforge::app
