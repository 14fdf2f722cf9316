// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/sandbox/child_work.h"

namespace lensforge {

/// Limits for the decoder of a picture with so many pixels, whatever the file contains.
ChildLimits decoder_limits(const std::filesystem::path& path, double pixels);

/// Sends rows from a decoding process.
class RowSender {
 public:
  explicit RowSender(const PieceSink& send) : send_(send) {}

  /// Call it first. @param fill  value of pixels that are not sent.
  void begin(int columns, int rows, float fill);
  /// Whole rows from `first` on. @pre begin()
  void send(int first, std::span<const float> rows);

 private:
  const PieceSink& send_;
  std::size_t columns_ = 0;
};

/// A picture from a decoding process, and the text that its work returned with it.
struct DecodedPicture {
  Image image;
  std::string text;
};

/// Reads a picture file in a child process with limits of memory and time, so that no file can
/// crash or hang this process. The child may call OpenImageIO.
/// @throw InputError naming the file if its decoder crashes or does not end; what `decode` throws;
///        Interrupted at most 0.1 s after the stop request.
DecodedPicture decode_in_child(
    const std::filesystem::path& path,
    const std::function<std::string(RowSender&, const RunControl&)>& decode,
    const RunControl& control);

}  // namespace lensforge
