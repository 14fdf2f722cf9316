// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>

#include "app/frame/command_line.h"
#include "app/frame/option_set.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/plan/cam_options.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "design/reflect/input.h"
#include "design/setup/option_tables.h"
#include "export/export.h"
#include "machine/send.h"

namespace lensforge::app {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Values just outside of limits.
std::vector<double> outside(const OptionSpec& spec) {
  const Limits& limits = spec.limits;
  const bool whole = spec.kind == OptionKind::kWhole;
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
template <class Options>
void expect_limits_enforced(const Arguments& line, const OptionTable<Options>& table) {
  for (const OptionField<Options>& row : table) {
    if (!row.is_number()) continue;
    ASSERT_FALSE(outside(row).empty()) << row.name;
    for (const double value : outside(row)) {
      const std::string text =
          row.kind == OptionKind::kWhole ? decimal_text(value, 0) : shortest_text(value);
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
  expect_limits_enforced({"design", "none.png", "--out", "none"}, design_fields());
  expect_limits_enforced({"design", "none.png", "--out", "none"}, light_fields());
  expect_limits_enforced({"design", "none.png", "--out", "none"}, weight_fields());
  expect_limits_enforced({"render", "none"}, render_fields());
  expect_limits_enforced({"cam", "none"}, cam_fields());
  expect_limits_enforced({"nest", "none", "--blank", "100,100", "--out", "none"}, cam_fields());
  expect_limits_enforced({"coupon", "--out", "none"}, coupon_fields());
  expect_limits_enforced({"export", "none", "--out", "none.step"}, export_fields());
  expect_limits_enforced({"reflect", "none.stl", "--out", "none"}, reflect::reflect_fields());
  expect_limits_enforced({"send", "none.ngc", "--dry-run"}, send_fields());
}

/// The library's own check refuses what the command refuses.
/// @param usual  accepted by `check`.
template <class Options, class Check>
void expect_library_refuses(const OptionTable<Options>& table, const Options& usual,
                            const Check& check) {
  EXPECT_NO_THROW(check(usual));
  for (const OptionField<Options>& row : table) {
    if (!row.is_number() || row.name == "--tool-diameter" || row.name == "--rough-tool") continue;
    for (const double value : outside(row)) {
      Options options = usual;
      row.set(options, row.kind == OptionKind::kWhole ? nlohmann::json(std::llround(value))
                                                      : nlohmann::json(value));
      EXPECT_THROW(check(options), InputError) << row.name << " " << value;
    }
  }
}

TEST(OptionLimits, AreThoseOfTheLibraries) {
  const Image picture(256, 8, 0.5F);
  const auto design = [&](const DesignOptions& options) { validate(options, picture); };
  expect_library_refuses(design_fields(), DesignOptions{}, design);
  expect_library_refuses(light_fields(), LightOptions{}, [&](const LightOptions& light) {
    DesignOptions options;
    options.light = light;
    design(options);
  });
  expect_library_refuses(weight_fields(), ObjectiveWeights{}, [&](const ObjectiveWeights& weights) {
    DesignOptions options;
    options.weights = weights;
    design(options);
  });
  expect_library_refuses(export_fields(), ExportOptions{},
                         [](const ExportOptions& options) { validate(options, "lens.step"); });
  expect_library_refuses(coupon_fields(), CouponOptions{},
                         [](const CouponOptions& options) { validate(options); });
  expect_library_refuses(
      reflect::reflect_fields(), reflect::ReflectOptions{},
      [](const reflect::ReflectOptions& options) { reflect::validate(options); });
  SendOptions sending;
  sending.port = "sim:grbl";
  expect_library_refuses(send_fields(), sending,
                         [](const SendOptions& options) { validate(options); });
  expect_library_refuses(cam_fields(), CamOptions{},
                         [](const CamOptions& options) { validate(options, OpticalSetup{}); });
}

TEST(OptionLimits, DefaultsKeepThem) {
  require_limits(design_fields(), DesignOptions{});
  require_limits(light_fields(), LightOptions{});
  require_limits(weight_fields(), ObjectiveWeights{});
  require_limits(render_fields(), RenderOptions{});
  require_limits(cam_fields(), CamOptions{});
  require_limits(export_fields(), ExportOptions{});
  require_limits(send_fields(), SendOptions{});
}

}  // namespace
}  // namespace lensforge::app
