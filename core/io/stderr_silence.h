// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Sends the process's standard error to nowhere while one lives, for libraries that print what
/// they should return (libpng as OpenImageIO sets it up). Several may live at once, in any thread:
/// the last one gone restores it. Hold it around single calls: what other threads print meanwhile
/// is lost too.
class StderrSilence {
 public:
  StderrSilence();
  ~StderrSilence();
  StderrSilence(const StderrSilence&) = delete;
  StderrSilence& operator=(const StderrSilence&) = delete;
};

}  // namespace lensforge
