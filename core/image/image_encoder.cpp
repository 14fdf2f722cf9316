// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_encoder.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <memory>

#include "core/error.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

/// Rows that are encoded between two checks for a stop request; EXR packs 16 at a time.
constexpr int kRowsAtOnce = 64;

void write_rows(OIIO::ImageOutput& output, const OIIO::ImageSpec& spec, const EncodedRows& rows,
                const std::string& what, const RunControl& control) {
  for (int first = 0; first < spec.height; first += kRowsAtOnce) {
    if (control.stop_requested()) throw Interrupted();
    control.report({"picture file", double{1} * first, double{1} * spec.height, ""});
    const int end = std::min(first + kRowsAtOnce, spec.height);
    if (output.write_scanlines(first, end, 0, spec.format, rows(first, end))) continue;
    throw RunError(what + ": cannot be written: " + output.geterror());
  }
}

}  // namespace

std::vector<unsigned char> encode_rows(const std::string& what, OIIO::ImageSpec spec,
                                       const std::string& extension, const EncodedRows& rows,
                                       const RunControl& control) {
  spec.attribute("Software", program_mark());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::string name = "picture" + extension;
  const auto output = OIIO::ImageOutput::create(name, &memory);
  if (!output) throw RunError(what + ": cannot be written: " + OIIO::geterror());
  const auto require = [&](bool done) {
    if (!done) throw RunError(what + ": cannot be written: " + output->geterror());
  };
  require(output->open(name, spec));
  write_rows(*output, spec, rows, what, control);
  require(output->close());
  return bytes;
}

}  // namespace lensforge
