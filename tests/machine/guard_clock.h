// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "machine/guard/register_map.h"
#include "machine/link/link.h"

namespace lensforge::testing {

/// Virtual time that passes only when a test lets it.
class ManualClock final : public Clock {
 public:
  [[nodiscard]] double now() const override { return now_; }
  void wait(double seconds) override { now_ += seconds; }

 private:
  double now_ = 1000.0;
};

inline RegisterMap shipped_map(const std::string& name) {
  return read_register_map(find_register_map(name));
}

}  // namespace lensforge::testing
