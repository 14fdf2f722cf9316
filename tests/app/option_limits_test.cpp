// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>

#include "app/frame/command_line.h"
#include "app/frame/option_set.h"
#include "cam/coupon/coupon.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/text/number_text.h"
#include "design/reflect/input.h"
#include "design/setup/design_options.h"
#include "export/export.h"
#include "machine/send.h"

namespace lensforge::app {
namespace {

using ::testing::StartsWith;

/// Values just outside of limits.
std::vector<double> outside(const FieldSpec& spec) {
  const Limits& limits = spec.limits;
  const bool whole = spec.kind == FieldKind::kWhole;
  std::vector<double> values;
  if (std::isfinite(limits.low)) {
    const double below = limits.low > 0.0 ? 0.5 * limits.low : limits.low - 1.0;
    values.push_back(limits.low_excluded ? limits.low : whole ? std::floor(limits.low) - 1 : below);
    if (limits.or_zero && values.back() == 0.0) values.back() = -1.0;
  }
  if (std::isfinite(limits.high)) values.push_back(2.0 * limits.high);
  return values;
}

/// @param line  the command with what it cannot do without.
void expect_limits_enforced(const Arguments& line, const Description& options) {
  for (const Field& row : options) {
    if (!row.is_number()) continue;
    ASSERT_FALSE(outside(row).empty()) << row.name;
    for (const double value : outside(row)) {
      const std::string text =
          row.kind == FieldKind::kWhole ? decimal_text(value, 0) : shortest_text(value);
      Arguments arguments = line;
      arguments.push_back(row.name + "=" + text);
      ::testing::internal::CaptureStderr();
      const int code = run_command_line(arguments);
      const std::string said = ::testing::internal::GetCapturedStderr();
      EXPECT_EQ(code, kBadInput) << row.name;
      EXPECT_THAT(said, StartsWith("lensforge: " + row.name + " " + text + ": must be " +
                                   row.limits.rule()));
    }
  }
}

TEST(OptionLimits, AreEnforcedByEveryCommandForEveryNumber) {
  const Arguments design{"design", "none.png", "--out", "none"};
  expect_limits_enforced(design, description_of(DesignOptions()));
  expect_limits_enforced(design, description_of(LightOptions()));
  expect_limits_enforced(design, description_of(ObjectiveWeights()));
  expect_limits_enforced({"render", "none"}, description_of(RenderOptions()));
  expect_limits_enforced({"cam", "none"}, description_of(CamOptions()));
  expect_limits_enforced({"nest", "none", "--blank", "100,100", "--out", "none"},
                         description_of(CamOptions()));
  expect_limits_enforced({"coupon", "--out", "none"}, description_of(CouponOptions()));
  expect_limits_enforced({"export", "none", "--out", "none.step"}, description_of(ExportOptions()));
  expect_limits_enforced({"reflect", "none.stl", "--out", "none"},
                         description_of(reflect::ReflectOptions()));
  expect_limits_enforced({"send", "none.ngc", "--dry-run"}, description_of(SendOptions()));
}

/// The library's own check refuses what the command refuses.
/// @param usual  accepted by `check`.
template <class Options, class Check>
void expect_library_refuses(const Options& usual, const Check& check) {
  EXPECT_NO_THROW(check(usual));
  Options options = usual;
  for (const Field& row : description_of(options)) {
    if (!row.is_number() || row.name == "--tool-diameter" || row.name == "--rough-tool") continue;
    for (const double value : outside(row)) {
      row.set(row.kind == FieldKind::kWhole ? FieldValue(static_cast<int>(std::llround(value)))
                                            : FieldValue(value));
      EXPECT_THROW(check(options), InputError) << row.name << " " << value;
    }
    options = usual;
  }
}

TEST(OptionLimits, AreThoseOfTheLibraries) {
  const Image picture(256, 8, 0.5F);
  const auto design = [&](const DesignOptions& options) { validate(options, picture); };
  expect_library_refuses(DesignOptions{}, design);
  expect_library_refuses(LightOptions{}, [&](const LightOptions& light) {
    DesignOptions options;
    options.light = light;
    design(options);
  });
  expect_library_refuses(ObjectiveWeights{}, [&](const ObjectiveWeights& weights) {
    DesignOptions options;
    options.weights = weights;
    design(options);
  });
  expect_library_refuses(ExportOptions{},
                         [](const ExportOptions& options) { validate(options, "lens.step"); });
  expect_library_refuses(CouponOptions{}, [](const CouponOptions& options) { validate(options); });
  expect_library_refuses(reflect::ReflectOptions{}, [](const reflect::ReflectOptions& options) {
    reflect::validate(options);
  });
  SendOptions sending;
  sending.port = "sim:grbl";
  expect_library_refuses(sending, [](const SendOptions& options) { validate(options); });
  expect_library_refuses(CamOptions{},
                         [](const CamOptions& options) { validate(options, OpticalSetup{}); });
}

TEST(OptionLimits, DefaultsKeepThem) {
  require_limits(DesignOptions{});
  require_limits(LightOptions{});
  require_limits(ObjectiveWeights{});
  require_limits(RenderOptions{});
  require_limits(CamOptions{});
  require_limits(ExportOptions{});
  require_limits(SendOptions{});
}

}  // namespace
}  // namespace lensforge::app
