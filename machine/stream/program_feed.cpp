// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/program_feed.h"

#include <algorithm>
#include <array>

#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// The most that programs have. A circle's added end must equal its start: rounding would turn it
/// into a tiny arc.
constexpr int kDecimals = 8;

/// G words, times ten, for which Grbl reads or writes its EEPROM.
constexpr std::array kStoredWords = {100, 280, 281, 300, 301, 540, 550, 560,
                                     570, 580, 590, 920, 921, 922, 923};

/// G words, times ten, that use the axis words of their line.
constexpr std::array kMotionWords = {0, 10, 20, 30, 100, 280, 281, 300, 301, 431, 800, 920};

bool touches_settings(const GcodeBlock& block) {
  const auto words = block.words();
  return std::any_of(words.begin(), words.end(), [](const GcodeWord& word) {
    return word.letter == 'G' &&
           std::find(kStoredWords.begin(), kStoredWords.end(), word.tenths) != kStoredWords.end();
  });
}

bool has_axis_word(const GcodeBlock& block) {
  const auto words = block.words();
  return std::any_of(words.begin(), words.end(), [](const GcodeWord& word) {
    return word.letter >= 'X' && word.letter <= 'Z';
  });
}

/// True if the line has a word that uses the axis words.
bool has_motion_word(const GcodeBlock& block) {
  const auto words = block.words();
  return std::any_of(words.begin(), words.end(), [](const GcodeWord& word) {
    return word.letter == 'G' &&
           std::find(kMotionWords.begin(), kMotionWords.end(), word.tenths) != kMotionWords.end();
  });
}

const char* motion_word(MotionMode mode) {
  switch (mode) {
    case MotionMode::kRapid:
      return "G0";
    case MotionMode::kFeed:
      return "G1";
    case MotionMode::kArcClockwise:
      return "G2";
    case MotionMode::kArcCounterClockwise:
      return "G3";
    case MotionMode::kNone:
      break;
  }
  return "";
}

}  // namespace

std::string added_words(const GcodeEffect& effect, const GcodeState& after) {
  std::string words;
  if (!effect.bare_circle) return words;
  const int normal = after.plane == ArcPlane::kXY ? 2 : after.plane == ArcPlane::kZX ? 1 : 0;
  const double unit = after.inches.value_or(false) ? kMillimetresPerInch : 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == normal) continue;
    const double at = after.absolute ? (after.position - after.origin())[axis] / unit : 0.0;
    words.append(1, "XYZ"[axis]).append(trimmed_decimal(at, kDecimals));
  }
  return words;
}

SpindleOrder spindle_order(const GcodeState& state) {
  if (state.spindle == SpindleTurn::kOff) return {};
  return {state.spindle, state.rpm};
}

ProgramFeed::ProgramFeed(std::istream& in, FeedOptions options)
    : options_(std::move(options)), reader_(in), interpreter_(options_.dialect, options_.start) {
  if (options_.first_line > 1) reader_.seek(options_.first_offset, options_.first_line);
}

std::optional<OutgoingLine> ProgramFeed::next() {
  if (!options_.before.empty()) {
    OutgoingLine own = std::move(options_.before.front());
    options_.before.pop_front();
    return own;
  }
  while (!interpreter_.ended()) {
    const std::optional<GcodeText> text = reader_.next();
    if (!text) return std::nullopt;
    std::optional<OutgoingLine> line = made_ready(*text);
    if (line) return line;
  }
  return std::nullopt;
}

std::optional<OutgoingLine> ProgramFeed::made_ready(const GcodeText& text) {
  const GcodeBlock block = parse_gcode_block(text);
  const GcodeState before = interpreter_.state();
  const GcodeEffect effect = interpreter_.run(block);
  OutgoingLine line;
  line.text = compact_gcode(text.text, false);
  if (line.text.empty()) return std::nullopt;
  const std::string added = added_words(effect, interpreter_.state());
  line.text += added;
  interpreter_.check_length(text, added.size());
  line.line = text.line;
  line.next_offset = text.next_offset;
  line.alone = touches_settings(block);
  note_effect(effect, before, line);
  // Picked up in the middle, the first line cannot lean on a motion word that was never sent.
  const bool moves = has_axis_word(block) || effect.bare_circle;
  if (first_ && options_.first_line > 1 && moves && !has_motion_word(block)) {
    line.text = std::string(motion_word(before.motion)).append(line.text);
  }
  first_ = false;
  const std::int64_t number = number_of(text.line, options_.dialect.max_line_number);
  const std::string word = std::string("N").append(std::to_string(number));
  const std::size_t length = word.size() + line.text.size();
  line.numbered = options_.number_lines && length <= options_.dialect.max_characters;
  if (line.numbered) line.text = word + line.text;
  return line;
}

void ProgramFeed::note_effect(const GcodeEffect& effect, const GcodeState& before,
                              OutgoingLine& line) const {
  for (const GcodeMotion& motion : effect.motions()) {
    line.cuts = line.cuts || !motion.rapid;
    line.travel = std::max(line.travel, motion.bounds().sizes().maxCoeff());
  }
  line.dwell = effect.dwell;
  line.tool_change = effect.tool_change.has_value();
  line.pauses = effect.pauses;
  line.ends = effect.ends;
  const SpindleOrder now = spindle_order(interpreter_.state());
  if (!(now == spindle_order(before))) line.spindle = now;
  if (line.spindle && line.spindle->turning() && line.cuts) {
    throw GcodeError(line.line,
                     "starts or changes the spindle and cuts in one line; its speed could not be "
                     "verified in between");
  }
  line.barrier = line.spindle || line.tool_change || line.pauses || line.ends;
}

}  // namespace lensforge
