// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "core/error.h"

namespace lensforge {

/// A file or folder that is to be read does not exist.
class MissingFile : public InputError {
 public:
  MissingFile(const std::string& message, std::filesystem::path path)
      : InputError(message), path_(std::move(path)) {}

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace lensforge
