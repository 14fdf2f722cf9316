// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/report_data.h"

#include <cctype>
#include <string>
#include <utility>
#include <vector>

#include "core/optics/picture_blur.h"
#include "core/text/words.h"

namespace lensforge {

PathSketch::PathSketch(std::string operation, double spacing, std::size_t most)
    : kept_{std::move(operation), {}, 1}, spacing_(spacing), most_(most) {}

void PathSketch::add(std::span<const PathMove> moves) {
  for (const PathMove& move : moves) {
    const Eigen::Vector2d step = (move.end - last_).head<2>();
    if (move.kind == MoveKind::kRapid || !started_) {
      begin_strip();
    } else if (step.dot(heading_) < 0.0) {
      begin_strip();
      strip_.emplace_back(last_.cast<float>());
      heading_ = step;
    } else if (strip_.empty()) {
      strip_.emplace_back(last_.cast<float>());
    }
    if (heading_.isZero() && !strip_.empty()) heading_ = step;
    const Eigen::Vector3f end = move.end.cast<float>();
    const bool far = strip_.empty() || (end - strip_.back()).norm() >= static_cast<float>(spacing_);
    if (move.kind != MoveKind::kRapid && started_ && far) strip_.push_back(end);
    last_ = move.end;
    started_ = true;
  }
}

ReportPath PathSketch::path() const {
  PathSketch ended = *this;
  ended.begin_strip();
  return std::move(ended.kept_);
}

/// Ends the strip at the last place; keeps it if its turn has come.
void PathSketch::begin_strip() {
  heading_.setZero();
  if (strip_.empty()) return;
  if (strip_.back() != last_.cast<float>()) strip_.emplace_back(last_.cast<float>());
  if (strips_++ % kept_.every == 0 && strip_.size() > 1) {
    points_ += strip_.size();
    kept_.strips.push_back(std::move(strip_));
  }
  strip_.clear();
  if (points_ > most_) thin_out();
}

/// Drops every second strip.
void PathSketch::thin_out() {
  std::vector<std::vector<Eigen::Vector3f>> half;
  points_ = 0;
  for (std::size_t k = 0; k < kept_.strips.size(); k += 2) {
    points_ += kept_.strips[k].size();
    half.push_back(std::move(kept_.strips[k]));
  }
  kept_.strips = std::move(half);
  kept_.every *= 2;
}

std::string z_words(double z_offset) {
  return joined({"Program Z = lens z ", z_offset < 0.0 ? "− " : "+ ",
                 decimal_text(std::abs(z_offset), 3), " mm"});
}

double ReportData::share_of_places() const {
  if (leakage.steps.empty()) return 0.0;
  const double whole = judged().part().quality.leakage;
  if (!(whole > 0.0)) return 0.0;
  double sum = 0.0;
  for (const LeakPlace& place : places) sum += place.leakage;
  return sum / whole;
}

std::string ReportData::judged_words() const {
  std::string words = joined({"Judged ", light_words, "."});
  if (!blurs.empty()) words = joined({words, " ", blurs_words()});
  return haze_words.empty() ? words : joined({words, " ", haze_words});
}

std::string ReportData::blurs_words() const {
  const std::string blur = blur_words(blurs);
  const std::string sentence =
      static_cast<char>(std::toupper(static_cast<unsigned char>(blur.front()))) + blur.substr(1);
  const PictureBlur& most = widest(blurs);
  if (most.pixels < kNoBlur) return sentence + ".";
  return joined({sentence, "; the widest, ", most.cause, ", would be less with ",
                 blur_remedy(most.cause), "."});
}

double ReportData::minutes() const {
  double sum = 0.0;
  for (const ReportOperation& operation : operations) sum += operation.minutes;
  return sum;
}

}  // namespace lensforge
