// SPDX-License-Identifier: GPL-3.0-or-later
// The program reader against the simulated controller's own parser, which shares no code with it.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <string>

#include "machine/gcode_text.h"
#include "machine/sim_talk.h"
#include "machine/stream/program_feed.h"

namespace lensforge {
namespace {

using Eigen::Vector3d;

/// Random lines of words that both know, in sensible and in senseless company.
class RandomProgram {
 public:
  explicit RandomProgram(std::uint64_t seed) : engine_(seed) {}

  std::string line() {
    switch (engine_() % 12) {
      case 0:
        return pick({"G90", "G91", "G20", "G21", "G17", "G18", "G19", "G54", "G55", "G59"});
      case 1:
        return pick({"M3 S900", "M4", "M5", "S20", "M8", "M9", "G4 P0.1", "G40", "G49", "G61",
                     "G91.1", "G80", "M1", "(x)", ""});
      case 2:
        return pick({"G53 G0", "G53 G1", "G53"}) + axes();
      case 3:
        return pick({"G2", "G3", "G2", "G3", ""}) + axes() + offsets();
      case 4:
        return pick({"G2", "G3"}) + axes() + " R" + number(20.0);
      case 5:
        return pick({"G93 G1", "G94 G1 F100", "G93", "G94", "F50", "G1 F20", "G1"});
      case 6:
        return pick({"G28", "G30", "G43.1", "G49"}) + (engine_() % 2 == 0 ? axes() : "");
      case 7:
        return std::string("N").append(std::to_string(engine_() % 1000)) + " G1" + axes() + feed();
      default:
        return pick({"G0", "G1", "", ""}) + axes() + feed();
    }
  }

 private:
  std::string pick(std::initializer_list<const char*> choices) {
    return *(choices.begin() + engine_() % choices.size());
  }
  std::string number(double span) {
    std::uniform_real_distribution<double> anywhere(-span, span);
    return std::to_string(anywhere(engine_)).substr(0, 6);
  }
  std::string axes() {
    std::string words;
    for (const char axis : {'X', 'Y', 'Z'}) {
      if (engine_() % 2 == 0) words.append(" ").append(1, axis).append(number(9.0));
    }
    return words;
  }
  std::string offsets() {
    std::string words;
    for (const char axis : {'I', 'J', 'K'}) {
      if (engine_() % 2 == 0) words.append(" ").append(1, axis).append(number(9.0));
    }
    return words;
  }
  std::string feed() { return engine_() % 4 == 0 ? " F300" : ""; }

  std::mt19937_64 engine_;
};

struct Compared {
  int accepted = 0;
  int motions = 0;
  int arcs = 0;
};

/// One program, line by line; ends at the first line that the reader refuses.
void compare(std::uint64_t seed, Compared& compared) {
  SimulatedOptions options = ready_grbl();
  options.instant = true;
  options.settings[12] = 0.5;
  options.settings[100] = options.settings[101] = options.settings[102] = 1e6;
  Talk talk(options, instant_wire());
  GcodeState start;
  for (int i = 0; i < 6; ++i) {
    start.origins[static_cast<std::size_t>(i)] = Vector3d(i, -2.0 * i, 0.5);
    talk.machine.controller().set_origin(i, start.origins[static_cast<std::size_t>(i)]);
  }
  start.g28 = start.g30 = Vector3d::Zero();
  GcodeInterpreter interpreter(grbl_dialect(), start);
  RandomProgram program(seed);
  std::string line = "G21 F100";
  for (int i = 0; i < 60; ++i, line = program.line()) {
    GcodeText text;
    text.text = line;
    GcodeEffect effect;
    try {
      effect = interpreter.run(parse_gcode_block(text));
    } catch (const GcodeError&) {
      continue;  // refused before anything is sent; the controller never sees it
    }
    talk.pieces.clear();
    line += added_words(effect, interpreter.state());
    ASSERT_EQ(talk.command(line), "ok\r\n") << line << ", seed " << seed;
    ++compared.accepted;
    const Vector3d stands = talk.machine.controller().position();
    ASSERT_LT((stands - interpreter.state().position).norm(), 2e-6) << line << ", seed " << seed;
    for (const GcodeMotion& motion : effect.motions()) {
      ++compared.motions;
      if (!motion.arc) continue;
      ++compared.arcs;
      // Every chord ends on the arc that the reader understood.
      const int chords = static_cast<int>(talk.pieces.size());
      for (int k = 1; k <= chords; ++k) {
        const Vector3d point = talk.pieces[static_cast<std::size_t>(k - 1)].end;
        const Vector3d expected = k == chords ? motion.end : motion.arc->at(double(k) / chords);
        ASSERT_LT((point - expected).norm(), 1e-4) << line << ", seed " << seed;
      }
    }
    for (const ExecutedPiece& piece : talk.pieces) {
      const GcodeMotion& motion = effect.motions().back();
      ASSERT_EQ(piece.rapid, motion.rapid) << line;
      ASSERT_NEAR(piece.feed, motion.feed, 1e-6 * (1.0 + motion.feed)) << line;
      ASSERT_EQ(piece.number, motion.number.value_or(0)) << line;
    }
  }
}

/// LENSFORGE_PARSER_PROGRAMS sets the number of programs; 1,500 without it.
TEST(GcodeInterpreter, AgreesWithTheSimulatedControllersParser) {
  const char* text = std::getenv("LENSFORGE_PARSER_PROGRAMS");
  const int programs = text == nullptr ? 1500 : std::atoi(text);
  Compared compared;
  for (int seed = 0; seed < programs && !HasFatalFailure(); ++seed) {
    compare(static_cast<std::uint64_t>(seed), compared);
  }
  EXPECT_GT(compared.accepted, 20 * programs);
  EXPECT_GT(compared.motions, 10 * programs);
  EXPECT_GT(compared.arcs, programs / 4);
}

}  // namespace
}  // namespace lensforge
