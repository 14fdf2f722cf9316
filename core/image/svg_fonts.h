// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fontconfig/fontconfig.h>

#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace lensforge {

/// Checks the installed fonts (fontconfig) for a drawing's text. A font counts as installed if one
/// of the families that the text names is installed or generic.
class SvgFonts {
 public:
  /// @param families  as font-family lists them.
  void add(const std::string& families) {
    if (families_.size() < kMostLists) families_.insert(families);
  }

  /// The first character that no installed font has, as a problem; empty if there is none.
  [[nodiscard]] std::string problem_of(const std::string& text);

  /// In plain words, the fonts that replace others.
  [[nodiscard]] std::vector<std::string> remarks() const;

 private:
  /// A look-up takes a millisecond, and a file may have a million lists.
  static constexpr std::size_t kMostLists = 100;

  struct DestroyCharacters {
    void operator()(FcCharSet* characters) const { FcCharSetDestroy(characters); }
  };

  std::set<std::string> families_;
  std::unique_ptr<FcCharSet, DestroyCharacters> installed_;  ///< The characters of all fonts.
};

}  // namespace lensforge
