// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/gcode/modal_words.h"

#include <string>
#include <string_view>

namespace lensforge {
namespace {

std::string word_name(const GcodeWord& word) {
  std::string name = std::string(1, word.letter).append(std::to_string(word.tenths / 10));
  if (word.tenths % 10 != 0) name.append(".").append(std::to_string(word.tenths % 10));
  return name;
}

std::optional<ModalGroup> g_group(int tenths) {
  switch (tenths) {
    case 40:
    case 280:
    case 300:
    case 530:
      return ModalGroup::kNonModal;
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return ModalGroup::kMotion;
    case 170:
    case 180:
    case 190:
      return ModalGroup::kPlane;
    case 200:
    case 210:
      return ModalGroup::kUnits;
    case 400:
      return ModalGroup::kCutterCompensation;
    case 430:
    case 431:
    case 490:
      return ModalGroup::kToolLength;
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return ModalGroup::kCoordinateSystem;
    case 51:
    case 610:
    case 611:
    case 640:
      return ModalGroup::kPathControl;
    case 900:
    case 910:
      return ModalGroup::kDistance;
    case 911:
      return ModalGroup::kArcDistance;
    case 930:
    case 940:
      return ModalGroup::kFeedMode;
    default:
      return std::nullopt;
  }
}

std::optional<ModalGroup> m_group(int tenths) {
  switch (tenths) {
    case 0:
    case 10:
    case 20:
    case 300:
      return ModalGroup::kStop;
    case 30:
    case 40:
    case 50:
      return ModalGroup::kSpindle;
    case 60:
      return ModalGroup::kToolChange;
    case 70:
    case 80:
    case 90:
      return ModalGroup::kCoolant;
    default:
      return std::nullopt;
  }
}

/// Whether a word that some controllers know is unknown to this one.
bool lacks(const GcodeDialect& dialect, const GcodeWord& word) {
  if (word.letter == 'M') {
    return (word.tenths == 60 && !dialect.tool_change) || (word.tenths == 70 && !dialect.mist);
  }
  switch (word.tenths) {
    case 0:
      return !dialect.rapid_word;
    case 51:
      return !dialect.contour_control;
    case 200:
      return !dialect.inches;
    case 430:
      return !dialect.tool_length;
    case 431:
      return !dialect.stated_length;
    case 611:
    case 640:
      return !dialect.path_blending;
    default:
      return false;
  }
}

/// What does instead of a word that a controller lacks; empty where nothing is known of it.
std::string way_out(const GcodeWord& word, const GcodeDialect& dialect) {
  const bool tool_change = word.letter == 'M' && word.tenths == 60;
  if (tool_change) return "; send one program for each tool";
  const bool table = word.letter == 'G' && word.tenths == 430;
  if (table && dialect.stated_length) {
    return ", which has no tool table; state the length with G43.1 Z, or touch off every tool";
  }
  return {};
}

[[noreturn]] void refuse_unknown(const GcodeBlock& block, const GcodeWord& word,
                                 const GcodeDialect& dialect) {
  const int tenths = word.tenths;
  const bool stores = word.letter == 'G' && (tenths == 100 || tenths == 281 || tenths == 301 ||
                                             (tenths >= 920 && tenths < 930));
  const std::string why = stores ? " changes the controller's stored offsets, which a job may not"
                                 : " is not supported for " + dialect.name + way_out(word, dialect);
  throw GcodeError(block.line, word_name(word) + why);
}

void refuse_letter(const GcodeBlock& block, char letter, const GcodeDialect& dialect) {
  constexpr std::string_view kLetters = "FGIJKMPSTXYZ";
  const bool known =
      kLetters.find(letter) != std::string_view::npos || (letter == 'H' && dialect.tool_length) ||
      (letter == 'R' && dialect.radius_arcs) || (letter == 'Q' && dialect.contour_control) ||
      (letter == 'O' && dialect.program_number);
  if (!known) {
    throw GcodeError(block.line,
                     std::string(1, letter) + " is no word that " + dialect.name + " knows");
  }
}

}  // namespace

ModalWords::ModalWords(const GcodeBlock& block, const GcodeDialect& dialect) {
  for (const GcodeWord& word : block.words()) {
    refuse_letter(block, word.letter, dialect);
    if (word.letter != 'G' && word.letter != 'M') continue;
    const auto group = word.letter == 'G' ? g_group(word.tenths) : m_group(word.tenths);
    if (!group) refuse_unknown(block, word, dialect);
    if (lacks(dialect, word)) refuse_unknown(block, word, dialect);
    std::optional<int>& slot = words_[static_cast<std::size_t>(*group)];
    if (slot) {
      throw GcodeError(block.line,
                       word_name(word) + " shares a line with another word of its modal group");
    }
    slot = word.tenths;
  }
}

}  // namespace lensforge
