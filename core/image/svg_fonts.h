// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fontconfig/fontconfig.h>

#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace lensforge {

/// Looks up in the installed fonts (fontconfig) what the text of a drawing needs. A font counts as
/// there if one of the families that the text names is there, or a generic one.
class SvgFonts {
 public:
  /// @param families  as font-family lists them.
  void add(const std::string& families) {
    if (families_.size() < kMostLists) families_.insert(families);
  }

  /// The first character that no installed font has, as a problem; empty if there is none.
  [[nodiscard]] std::string problem_of(const std::string& text);

  /// In plain words, which fonts are drawn in place of others.
  [[nodiscard]] std::vector<std::string> remarks() const;

 private:
  /// Each takes a millisecond to look up, and a file may have a million.
  static constexpr std::size_t kMostLists = 100;

  struct DestroyCharacters {
    void operator()(FcCharSet* characters) const { FcCharSetDestroy(characters); }
  };

  std::set<std::string> families_;
  std::unique_ptr<FcCharSet, DestroyCharacters> installed_;  ///< The characters of all fonts.
};

}  // namespace lensforge
