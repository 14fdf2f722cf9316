// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/jpeg_outline.h"

// libjpeg fills the missing part of a truncated file with grey and only warns, and it allocates the
// whole picture of a progressive file on opening. So end and size are checked before. Markers:
// ITU-T T.81, Table B.1.
namespace lensforge {
namespace {

constexpr int kStartOfImage = 0xD8;
constexpr int kEndOfImage = 0xD9;
constexpr int kEndOfFile = -1;

bool stands_alone(int marker) { return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8); }

bool is_start_of_frame(int marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

int read_two_bytes(std::istream& file) {
  const int high = file.get();
  const int low = file.get();
  return file ? 256 * high + low : kEndOfFile;
}

/// The next marker's code. Skips entropy-coded data, where FF is followed by 00 or a restart
/// marker.
int next_marker(std::istream& file) {
  std::streambuf& bytes = *file.rdbuf();
  for (int byte = bytes.sbumpc(); byte != kEndOfFile; byte = bytes.sbumpc()) {
    if (byte != 0xFF) continue;
    while (byte == 0xFF) byte = bytes.sbumpc();
    if (byte != 0x00 && !stands_alone(byte)) return byte;
  }
  return kEndOfFile;
}

void read_frame_size(std::istream& file, JpegOutline& outline) {
  file.get();  // Bits per sample.
  outline.rows = read_two_bytes(file);
  outline.columns = read_two_bytes(file);
}

}  // namespace

std::optional<JpegOutline> read_jpeg_outline(std::istream& file) {
  if (file.get() != 0xFF || file.get() != kStartOfImage) return std::nullopt;
  JpegOutline outline;
  for (int marker = next_marker(file); marker != kEndOfFile; marker = next_marker(file)) {
    if (marker == kEndOfImage) {
      outline.complete = true;
      break;
    }
    const std::streamoff begin = file.tellg();
    const int length = read_two_bytes(file);
    if (length < 2) break;
    if (is_start_of_frame(marker)) read_frame_size(file, outline);
    file.seekg(begin + length);
  }
  return outline;
}

}  // namespace lensforge
