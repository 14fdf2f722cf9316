// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/filesystem.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "core/compute/run_control.h"

namespace lensforge {

/// An open file for OpenImageIO's decoders that ends early once a stop is requested: a decoder that
/// wants a whole file on opening then gives up within a moment.
class PictureFile {
 public:
  /// @pre `run` outlives this. @throw InputError if it cannot be opened.
  PictureFile(const std::filesystem::path& path, const RunControl& run);
  /// The same for bytes in memory. @pre `bytes` and `run` outlive this.
  PictureFile(const std::string& bytes, const RunControl& run);

  [[nodiscard]] OIIO::Filesystem::IOProxy* proxy() const { return proxy_.get(); }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
  std::unique_ptr<OIIO::Filesystem::IOProxy> proxy_;
};

}  // namespace lensforge
