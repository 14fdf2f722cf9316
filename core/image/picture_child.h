// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/sandbox/child_work.h"

namespace lensforge {

/// What a decoder of a picture with so many pixels may take at most, whatever is in the file.
ChildLimits decoder_limits(const std::filesystem::path& path, double pixels);

/// Where a decoding process sends what it read.
class RowSender {
 public:
  explicit RowSender(const PieceSink& send) : send_(send) {}

  /// To be called first. @param fill  value of the pixels that are not sent.
  void begin(int columns, int rows, float fill);
  /// Whole rows from `first` on. @pre begin()
  void send(int first, std::span<const float> rows);

 private:
  const PieceSink& send_;
  std::size_t columns_ = 0;
};

/// A picture from a decoding process, and the text that its work returned.
struct DecodedPicture {
  Image image;
  std::string text;
};

/// Reads a picture file in a child process with limits of memory and time, so that no file can
/// crash or hang this one; OpenImageIO can be called there.
/// @throw InputError naming the file if its decoder crashes or comes to no end; what `decode`
///        throws; Interrupted at most 0.1 s after the stop request.
DecodedPicture decode_in_child(
    const std::filesystem::path& path,
    const std::function<std::string(RowSender&, const RunControl&)>& decode,
    const RunControl& control);

}  // namespace lensforge
