// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/io/files.h"

namespace lensforge {

/// Deleter for what a C library has made, by that library's function.
template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* thing) const {
    kFree(thing);
  }
};

/// An SVG feature that librsvg does not draw.
struct UndrawnThing {
  std::string_view name;  ///< Name of the element, attribute or property.
  std::string_view what;  ///< Description in plain words.
  std::string_view advice;
  std::string_view harmless = "";  ///< Values without effect, separated by " | ".
  unsigned drawn_since = kNever;   ///< Minor version of librsvg 2 that draws it.

  static constexpr unsigned kNever = ~0U;
};

/// Elements of SVG and of programs that write it. Elements in neither this table nor
/// drawn_elements() are not drawn either.
std::span<const UndrawnThing> undrawn_elements();

/// SVG elements that librsvg draws or uses, or that show nothing.
std::span<const std::string_view> drawn_elements();

/// Attributes of text only.
std::span<const UndrawnThing> undrawn_text_attributes();

/// Properties, as attributes and in styles, that change text; those that change other things; and
/// those that have a meaning only in styles.
std::span<const UndrawnThing> undrawn_text_properties();
std::span<const UndrawnThing> undrawn_properties();
std::span<const UndrawnThing> undrawn_style_properties();

/// The row with this name, or nullptr; without what the librsvg here draws.
const UndrawnThing* find_undrawn(std::span<const UndrawnThing> table, std::string_view name);

/// True if this value, trimmed, has no effect.
bool is_harmless(const UndrawnThing& thing, std::string_view value);

/// Needs of an SVG file beyond its own content and librsvg's features. They are found in
/// svg_needs.cpp.
struct SvgNeeds {
  /// In plain words: fonts that are not installed and their replacements. Each once.
  std::vector<std::string> remarks;
  /// In plain words: what is not drawn, files that it refers to. Each kind once.
  std::vector<std::string> left_out;
  std::string problem;  ///< Why its text cannot be drawn at all; empty if it can.
};

/// Walks through the text of a file without opening anything that it refers to. @param xml  well
/// formed or not. @pre Runs in a separate process: it keeps libxml2 from opening any file there.
SvgNeeds svg_needs(std::string_view xml);

/// Returns the text of an SVG file with the pictures in its data: addresses changed so that librsvg
/// (2.54) draws them correctly: pictures with an Exif orientation are turned upright and written as
/// PNG, and a wrong type is removed from an address. All else is unchanged. @param remarks  gets
/// the pictures turned.
/// @pre No other thread uses gdk-pixbuf.
std::string with_fit_pictures(const std::string& xml, std::vector<std::string>& remarks);

/// Collects findings from the lines that librsvg prints about styles and values that it
/// ignores: one per kind, in the order of their kinds.
class SvgLogReader {
 public:
  void take_line(std::string_view line);
  [[nodiscard]] std::vector<std::string> findings() const;

 private:
  void take_declaration(std::string_view declaration);
  void take_rule(std::string_view error, std::string_view rule);
  void take_value(std::string_view name, std::string_view value);
  void add(const std::string& kind, const std::string& finding);

  std::string attribute_;  ///< Attribute whose value is on the next line.
  std::map<std::string, std::string> findings_;
};

/// While one exists, makes librsvg print what it ignores, and reads it. Use it in a separate
/// process whose standard output is not needed, before the first call of librsvg.
class SvgLog {
 public:
  SvgLog();
  ~SvgLog();
  SvgLog(const SvgLog&) = delete;
  SvgLog& operator=(const SvgLog&) = delete;

  /// Ends the log and returns in plain words what was ignored.
  std::vector<std::string> take();

 private:
  void read();

  Descriptor reading_;
  SvgLogReader reader_;
  std::thread thread_;
};

}  // namespace lensforge
