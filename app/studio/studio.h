// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "app/frame/command_line.h"

namespace lensforge::app {

/// Serves the page that leads from a picture to a part, to browsers on this machine, and runs the
/// commands that the page asks for. Projects are folders in one folder; nothing outside of it can
/// be reached. Only a browser that opened address() is answered, since a page can move a machine.
class Studio {
 public:
  /// @param folder  of the projects; made if it does not exist. @param port  0 takes a free one.
  /// @param common  words that every computing command gets: --threads, --device.
  /// @throw InputError naming folder or --port.
  Studio(const std::filesystem::path& folder, int port, Arguments common);
  /// Interrupts all jobs; they can be resumed.
  ~Studio();
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  /// "http://127.0.0.1:8420/?key=…": with the key, which is kept in the folder.
  [[nodiscard]] std::string address() const;

 private:
  class Content;
  std::unique_ptr<Content> content_;
};

}  // namespace lensforge::app
