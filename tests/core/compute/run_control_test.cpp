// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/compute/executor.h"

namespace lensforge {
namespace {

TEST(RunControl, TheDefaultNeitherReportsNorStops) {
  const RunControl control;
  control.report({"stage", 1.0, 2.0, ""});
  EXPECT_FALSE(control.stop_requested());
}

TEST(RunControl, ReportsReachTheSinkAndStopsTheWork) {
  std::stop_source source;
  double done = 0.0;
  const RunControl control(source.get_token(), [&](const Progress& p) { done = p.done; });
  control.report({"stage", 3.0, 4.0, ""});
  EXPECT_EQ(done, 3.0);
  EXPECT_FALSE(control.stop_requested());
  source.request_stop();
  EXPECT_TRUE(control.stop_requested());
}

}  // namespace
}  // namespace lensforge
