// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/cam.h"
#include "core/temp_folder.h"

/// Cuts that are quick enough for a test.
namespace lensforge::testing {

/// With everything that a cut has, predicted coarsely, by rays: waves take longer.
inline CamOptions coarse() {
  CamOptions options;
  options.sample_spacing = 0.03;
  options.light = LightModel::kRays;
  return options;
}

inline CamOptions programs_only() {
  CamOptions options;
  options.render = false;
  return options;
}

inline CamResult run_cut(const Lens& lens, const CamOptions& options, const TempFolder& folder,
                         const RunControl& control = {}) {
  return make_cut(lens, options, folder.path(), Executor::cpu(2), control);
}

}  // namespace lensforge::testing
