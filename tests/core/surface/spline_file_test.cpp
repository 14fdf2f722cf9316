// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "core/lens/surface_check.h"
#include "core/spline/control_net.h"
#include "core/surface/sample_splines.h"
#include "core/temp_folder.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

OpticalSetup setup_of_sample() {
  OpticalSetup setup;
  setup.lens_size = setup.image_size = {15.0, 10.0};
  return setup;
}

TEST(SplineFile, ComesBackToTheBit) {
  const TempFolder folder;
  const ControlNet net = sample_spline();
  write_spline(net, folder / "surface.spline");
  const ControlNet read = read_spline(folder / "surface.spline");
  EXPECT_EQ(read.shape, net.shape);
  EXPECT_EQ(read.points, net.points);
  EXPECT_EQ(folder.file_count(), 1U);
}

struct Damage {
  const char* name;
  std::function<void(std::string&)> apply;
  const char* why;
};

void replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

TEST(SplineFile, RefusesWhatIsDamaged) {
  const TempFolder folder;
  write_spline(sample_spline(), folder / "good.spline");
  const std::string good = read_bytes(folder / "good.spline");
  const Damage damages[] = {
      {"version", [](auto& s) { replace(s, "spline 1", "spline 2"); }, "no spline of this version"},
      {"cut", [](auto& s) { s.resize(s.size() - 8); }, "truncated or corrupt"},
      {"longer", [](auto& s) { s += "12345678"; }, "truncated or corrupt"},
      {"no header", [](auto& s) { s.resize(25); }, "has no header"},
      {"header", [](auto& s) { replace(s, "{", "["); }, "header"},
      {"degree", [](auto& s) { replace(s, "\"degree\":3", "\"degree\":2"); }, "only 3"},
      {"units", [](auto& s) { replace(s, "\"mm\"", "\"in\""); }, "only \"mm\""},
      {"knots", [](auto& s) { replace(s, "uniform, clamped", "uniform, floating"); }, "'knots'"},
      {"few", [](auto& s) { replace(s, "[14,11]", "[14,3]"); }, "at least 4"},
      {"other count", [](auto& s) { replace(s, "[14,11]", "[14,12]"); }, "calls for 168 points"},
      {"no number",
       [](auto& s) {
         const double nan = std::numeric_limits<double>::quiet_NaN();
         std::memcpy(s.data() + s.size() - sizeof(nan), &nan, sizeof(nan));
       },
       "control point 153 is not finite"}};
  for (const Damage& damage : damages) {
    std::string bytes = good;
    damage.apply(bytes);
    write_bytes(folder / "bad.spline", bytes);
    EXPECT_THAT(message_of<InputError>([&] { read_spline(folder / "bad.spline"); }),
                HasSubstr(damage.why))
        << damage.name;
  }
  EXPECT_THAT(message_of<InputError>([&] { read_spline(folder / "none.spline"); }),
              HasSubstr("none.spline"));
}

TEST(SplineFault, NamesWhatCannotBeALens) {
  const ControlNet good = sample_spline();
  const OpticalSetup setup = setup_of_sample();
  EXPECT_FALSE(spline_fault(good, setup));
  ControlNet net = good;
  net.points(0, 13 * 1) += 1e-3;  // The last point of the first row.
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("by lens_size it must be 15"));
  net = good;
  net.points(0, 14 * 5 + 6) = 1.0;
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("counter-clockwise"));
  net = good;
  net.points.row(2).array() -= 6.0;
  EXPECT_THAT(spline_fault(net, setup).value_or(""), HasSubstr("entry face"));
}

}  // namespace
}  // namespace lensforge::testing
