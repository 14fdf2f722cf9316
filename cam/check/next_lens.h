// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cam/check/causes.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/plan/cam_options.h"
#include "cam/workshop/workshop.h"
#include "core/lens/lens.h"

namespace lensforge {

/// What the design of the next lens should know of a photograph's causes. A cause that the
/// photograph cannot tell from another is left out, and haze: dust, glare and a camera's tone curve
/// look like a rough surface.
struct NextLens {
  /// An option of `design` with its value, as they are typed.
  struct Option {
    std::string name;
    std::string value;
  };

  Workshop workshop;                ///< With what was learnt of it.
  std::vector<FittedValue> values;  ///< That were learnt, by the workshop file's keys.
  std::vector<Option> options;      ///< For the wall and the lamp as they are.
};

/// @param options  with the workshop that made the part.
NextLens next_lens(const CauseFit& fit, const Lens& lens, const CamOptions& options);

/// "--focal 16.48mm --source-angle 7.1"; empty without options.
std::string words_of(const std::vector<NextLens::Option>& options);

/// Writes the workshop with what was learnt of it, as fit_workshop() does.
/// @param text   of the workshop's file; empty for the default one.
/// @param photo  whose name the file's first comment has.
/// @pre something was learnt. @throw RunError if it cannot be written.
void write_workshop(const NextLens& next, const std::string& text, const std::string& photo,
                    const std::filesystem::path& out);

}  // namespace lensforge
