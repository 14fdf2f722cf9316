// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/io/descriptor.h"

namespace lensforge {

/// Collects findings out of lines that librsvg (2.54) prints of a file's styles and values that it
/// passes over: one for each kind, in the order of their kinds.
class SvgLogReader {
 public:
  void take_line(std::string_view line);
  [[nodiscard]] std::vector<std::string> findings() const;

 private:
  void take_declaration(std::string_view declaration);
  void take_rule(std::string_view error, std::string_view rule);
  void take_value(std::string_view name, std::string_view value);
  void add(const std::string& kind, const std::string& finding);

  std::string attribute_;  ///< Whose value the next line gives.
  std::map<std::string, std::string> findings_;
};

/// Makes librsvg print what it passes over, and reads that, while one lives: in a process of its
/// own whose standard output nobody else needs, before librsvg is called for the first time.
class SvgLog {
 public:
  SvgLog();
  ~SvgLog();
  SvgLog(const SvgLog&) = delete;
  SvgLog& operator=(const SvgLog&) = delete;

  /// What was passed over, in plain words; ends it.
  std::vector<std::string> take();

 private:
  void read();

  Descriptor reading_;
  SvgLogReader reader_;
  std::thread thread_;
};

}  // namespace lensforge
