// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_options.h"

#include "cam/post/program_writer.h"

namespace lensforge {
namespace {

using O = CouponOptions;
using R = Row<O>;

constexpr double kShortest = 5.0;     ///< mm between marks; below it a calliper reads nothing.
constexpr double kLongest = 500.0;    ///< mm
constexpr double kShallowest = 0.01;  ///< mm; a clamped sheet is no flatter.
constexpr double kDeepest = 1.0;      ///< mm
constexpr double kThinnest = 0.5;     ///< mm
constexpr double kThickest = 100.0;   ///< mm

OptionField<O> post() {
  OptionField<O> row = R::text(
      "--post", [](auto& o) -> auto& { return o.post.name; }, "NAME|FILE.toml",
      "dialect: linuxcnc, grbl, grblhal, fanuc, weihong, or a description of one");
  row.set = [](O& o, const nlohmann::json& value) { o.post = find_post(value, "--post"); };
  return row;
}

}  // namespace

const OptionTable<CouponOptions>& coupon_fields() {
  static const OptionTable<O> table{
      R::length("--length", &O::length, Limits::between(kShortest, kLongest),
                "distance of the two marks across the passes; the longer, the better the pitch "
                "error is known"),
      R::length("--depth", &O::depth, Limits::between(kShallowest, kDeepest),
                "of the pads below the top of the blank"),
      R::length("--thickness", &O::thickness, Limits::between(kThinnest, kThickest),
                "of the blank"),
      post(),
      R::number("--spin-up", &O::spin_up, Limits::between(0, kMaxPause), "s",
                "wait after spindle start"),
      R::word<Coolant>(
          "--coolant", &O::coolant,
          {{"off", Coolant::kOff}, {"mist", Coolant::kMist}, {"flood", Coolant::kFlood}},
          "coolant"),
      R::flag("--force", &O::force,
              "replace files that lensforge did not write, or that were changed since")};
  return table;
}

}  // namespace lensforge
