// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_encoder.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <memory>

#include "core/error.h"
#include "core/image/openimageio_use.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

/// Rows encoded between two checks for a stop request; EXR packs 16 at a time.
constexpr int kRowsAtOnce = 64;

void write_rows(OIIO::ImageOutput& output, const OIIO::ImageSpec& spec, const EncodedRows& rows,
                const std::string& what, const RunControl& control) {
  for (int first = 0; first < spec.height; first += kRowsAtOnce) {
    if (control.stop_requested()) throw Interrupted();
    control.report({"picture file", double{1} * first, double{1} * spec.height, ""});
    const int end = std::min(first + kRowsAtOnce, spec.height);
    const auto* const values = rows(first, end);
    const OpenImageIoUse use;
    if (output.write_scanlines(first, end, 0, spec.format, values)) continue;
    throw RunError(what + ": cannot be written: " + output.geterror());
  }
}

std::unique_ptr<OIIO::ImageOutput> create_output(const std::string& name,
                                                 OIIO::Filesystem::IOVecOutput& memory,
                                                 const std::string& what) {
  const OpenImageIoUse use;
  auto output = OIIO::ImageOutput::create(name, &memory);
  if (!output) throw RunError(what + ": cannot be written: " + OIIO::geterror());
  return output;
}

}  // namespace

std::vector<unsigned char> encode_rows(const std::string& what, OIIO::ImageSpec spec,
                                       const std::string& extension, const EncodedRows& rows,
                                       const RunControl& control) {
  spec.attribute("Software", program_mark());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::string name = "picture" + extension;
  const std::unique_ptr<OIIO::ImageOutput> output = create_output(name, memory, what);
  const auto require = [&](const auto& call) {
    const OpenImageIoUse use;
    if (!call()) throw RunError(what + ": cannot be written: " + output->geterror());
  };
  require([&] { return output->open(name, spec); });
  write_rows(*output, spec, rows, what, control);
  require([&] { return output->close(); });
  return bytes;
}

}  // namespace lensforge
