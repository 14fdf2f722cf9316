// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "machine/link/link.h"

namespace lensforge::testing {

/// A controller that takes every line at once and never moves: link and clock in one, for what a
/// sender does and how fast it is. What it answers can be changed for single lines.
class FastController : public Link, public Clock {
 public:
  int blocks = 15;
  int bytes = 128;
  std::string state = "Idle";
  double spindle = 0.0;               ///< As reported; M3 sets it to the S word.
  bool keep_lines = true;             ///< Remember what was received.
  std::vector<std::string> lines;     ///< Received so far, without their ends.
  std::vector<std::string> urgent;    ///< Realtime bytes but ?, and how many lines stood before.
  std::size_t most_bytes = 1U << 20;  ///< Maximum per write().
  /// Answers to a line in place of "ok"; the line's number in order of arrival is the second value.
  std::function<std::string(const std::string&, std::int64_t)> answer;
  std::int64_t received = 0;
  std::int64_t status_asked = 0;
  double per_line = 0.0;  ///< Virtual seconds that a line takes.

  [[nodiscard]] double now() const override { return now_; }
  void wait(double seconds) override { now_ += seconds; }

  std::string read(double wait) override {
    if (out_.empty()) now_ += std::max(wait, 1e-6);
    std::string bytes_out;
    bytes_out.swap(out_);
    return bytes_out;
  }

  std::size_t write(std::string_view given) override {
    const std::string_view taken = given.substr(0, most_bytes);
    for (const char byte : taken) take(byte);
    return taken.size();
  }

  void say(const std::string& text) { out_ += text; }

 private:
  void take(char byte) {
    switch (byte) {
      case '?':
        ++status_asked;
        out_ += "<" + state + "|MPos:0.000,0.000,0.000|Bf:" + std::to_string(blocks) + "," +
                std::to_string(bytes) + "|FS:0," + std::to_string(static_cast<int>(spindle)) +
                ">\r\n";
        return;
      case '!':
        urgent.emplace_back("!");
        if (state == "Run" || hold_from_idle) state = "Hold:0";
        return;
      case '~':
        urgent.emplace_back("~");
        state = "Idle";
        return;
      case '\x18':
        urgent.emplace_back("reset");
        state = "Idle";
        spindle = 0.0;
        line_.clear();
        out_ += "\r\nGrbl 1.1h ['$' for help]\r\n";
        return;
      case '\n':
        end_line();
        return;
      default:
        line_ += byte;
    }
  }

  void end_line() {
    ++received;
    now_ += per_line;
    if (keep_lines) lines.push_back(line_);
    const std::size_t speed = line_.find('S');
    if (speed != std::string::npos) word_s_ = std::stod(line_.substr(speed + 1));
    if (line_.find("M3") != std::string::npos) spindle = word_s_;
    if (line_.find("M5") != std::string::npos || line_.ends_with("M2")) spindle = 0.0;
    out_ += reply();
    line_.clear();
  }

  std::string reply() {
    if (line_ == "$I") return "[VER:1.1h.20190830:]\r\n[OPT:VN,15,128]\r\nok\r\n";
    if (line_ == "$$") return "$13=0\r\n$30=24000\r\n$32=0\r\n$100=250.000\r\nok\r\n";
    if (line_ == "$#") return "[G54:10.000,20.000,-30.000]\r\n[TLO:0.000]\r\nok\r\n";
    return answer ? answer(line_, received) : "ok\r\n";
  }

 public:
  bool hold_from_idle = true;  ///< A feed hold is answered by Hold:0 even where nothing moves.

 private:
  double now_ = 0.0;
  double word_s_ = 0.0;
  std::string line_;
  std::string out_;
};

}  // namespace lensforge::testing
