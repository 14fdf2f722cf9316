// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/coupon_settings.h"

#include "core/error.h"
#include "core/text/toml_fields.h"

namespace lensforge::app {

void add_coupon_options(OptionSet& options, CouponSettings& settings) {
  options.required_text("--out", settings.out, "DIR|FILE",
                        "folder for program, sheet and file of readings; with --fit the workshop "
                        "file to write");
  options.text(
      "--fit", settings.fit, "FILE.toml",
      "fit the workshop to these readings of a coupon instead of making one: polish.sigma, "
      "the finishing ball's diameter and finish.pitch_error");
  options.text("--workshop", settings.workshop, "FILE.toml",
               "the workshop that cuts the coupon; the fitted one differs from it in these values "
               "only");
  options.fields(coupon_fields(), settings.coupon);
}

void settle(const OptionSet& options, CouponSettings& settings) {
  if (!settings.workshop.empty()) {
    settings.workshop_text = read_toml_file(settings.workshop, "a workshop");
    settings.coupon.workshop = parse_workshop(settings.workshop_text, settings.workshop);
  }
  if (settings.fit.empty()) return;
  for (const OptionField<CouponOptions>& row : coupon_fields()) {
    if (row.name != "--force" && options.given(row.name)) {
      throw InputError(row.name + ": is for making a coupon, not for --fit");
    }
  }
}

}  // namespace lensforge::app
