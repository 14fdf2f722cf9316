// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "app/batch/batch_job.h"

namespace lensforge::app {

/// An option and the values that it takes in turn.
struct GridAxis {
  std::string command;  ///< Empty: the job's first command that has the option.
  std::string option;
  std::vector<std::string> values;
};

/// Reads "focal=250,300" and "cam.pitch=0.05,0.06". @throw InputError naming word and rule.
std::vector<GridAxis> read_grid(const std::vector<std::string>& words);

/// Every job with every combination of values, the last axis fastest. A job's name takes what it is
/// given: "portrait-focal250-pitch0.05".
/// @throw InputError if none of a job's commands has an option, or two names become the same.
std::vector<BatchJob> expanded(const std::vector<BatchJob>& jobs,
                               const std::vector<GridAxis>& axes);

}  // namespace lensforge::app
