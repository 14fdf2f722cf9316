// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>

#include <filesystem>

namespace lensforge {

/// Adds the "ICCProfile" of a HEIF file to the metadata that OpenImageIO (2.4) reads. Its
/// orientation comes from transformations, which decoders apply, not from Exif (ISO/IEC 23000-22,
/// 7.2.2).
void add_heif_metadata(const std::filesystem::path& path, OIIO::ImageSpec& spec);

/// Adds "ICCProfile" and "Orientation" of a WebP file (RFC 9649, sections 2.7.1.4 and 2.7.1.5).
void add_webp_metadata(const std::filesystem::path& path, OIIO::ImageSpec& spec);

}  // namespace lensforge
