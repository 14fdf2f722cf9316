// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/temp_folder.h"

namespace lensforge::testing {

/// The message with which a file is refused as a picture; it begins with the file's name.
inline std::string picture_refusal(const std::filesystem::path& path) {
  std::string message = message_of<InputError>([&] { read_image(path); });
  EXPECT_THAT(message, ::testing::StartsWith(path.string() + ": "));
  return message;
}

}  // namespace lensforge::testing
