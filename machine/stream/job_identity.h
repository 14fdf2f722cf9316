// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

namespace lensforge {

/// Which program a job runs: another file is another job, whatever its name.
struct JobIdentity {
  std::string sha256;      ///< Of the whole file, 64 hexadecimal digits.
  std::int64_t bytes = 0;  ///< Its size.
  std::string name;        ///< Its name without folder, for the reader's eyes only.

  [[nodiscard]] bool same_program(const JobIdentity& other) const {
    return sha256 == other.sha256 && bytes == other.bytes;
  }
};

}  // namespace lensforge
