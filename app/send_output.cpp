// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/send_output.h"

#include "app/json_output.h"
#include "app/operator_view.h"
#include "core/text/printable.h"

namespace lensforge::app {
namespace {

nlohmann::json box_json(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return nullptr;
  return {{"min", {box.min().x(), box.min().y(), box.min().z()}},
          {"max", {box.max().x(), box.max().y(), box.max().z()}}};
}

std::string box_text(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return "nothing";
  std::string text;
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (k > 0) text.append(", ");
    text.append(1, "XYZ"[k]).append(" ").append(fixed(box.min()[k], 3)).append(" to ");
    text.append(fixed(box.max()[k], 3));
  }
  return text;
}

nlohmann::json facts_json(const ProgramFacts& facts) {
  return {{"lines", facts.lines},
          {"sent_lines", facts.sent_lines},
          {"sent_bytes", facts.sent_bytes},
          {"motions", facts.motions},
          {"units", facts.inches ? "inch" : "mm"},
          {"extent", box_json(facts.extent)},
          {"cut_extent", box_json(facts.cut_extent)},
          {"top_feed", facts.top_feed},
          {"top_rpm", facts.top_rpm},
          {"tool_changes", facts.tool_changes},
          {"pauses", facts.pauses},
          {"seconds", facts.time.seconds},
          {"stream_limited", facts.time.stream_limited()},
          {"stream_limited_seconds", facts.time.stream_limited_seconds},
          {"peak_lines_per_second", facts.time.peak_lines_per_second},
          {"peak_bytes_per_second", facts.time.peak_bytes_per_second}};
}

nlohmann::json result_json(const SendResult& result) {
  return {{"cause", cause_name(result.cause)},
          {"reason", result.reason},
          {"sent", result.sent},
          {"acknowledged", result.acknowledged},
          {"executed", result.executed},
          {"at_rest", result.at_rest},
          {"seconds", result.seconds}};
}

std::string result_text(const SendResult& result) {
  return "  sent         up to line " + std::to_string(result.sent) + "\n" +  //
         "  taken        up to line " + std::to_string(result.acknowledged) + "\n" +
         "  carried out  up to line " + std::to_string(result.executed) + " for sure\n" +
         "  machine      " +
         (result.at_rest ? "stands still" : "was not seen to come to rest: look at it") + "\n" +
         "  took         " + duration_text(result.seconds) + "\n";
}

}  // namespace

std::string facts_text(const ProgramFacts& facts) {
  return "  program      " + std::to_string(facts.lines) + " lines, " +
         std::to_string(facts.motions) + " motions, up to F" + fixed(facts.top_feed, 0) + " and S" +
         fixed(facts.top_rpm, 0) + "\n" +                        //
         "  motion       " + box_text(facts.extent) + " mm\n" +  //
         "  time         " + duration_text(facts.time.seconds) +
         (facts.time.stream_limited()
              ? ", " + duration_text(facts.time.stream_limited_seconds) + " as lines arrive"
              : std::string()) +
         "\n";
}

std::string status_word(const SendSummary& summary) {
  return summary.result ? status_word(summary.result->status) : "checked";
}

std::string status_word(SendStatus status) {
  switch (status) {
    case SendStatus::kDone:
      return "done";
    case SendStatus::kInterrupted:
      return "interrupted";
    case SendStatus::kFault:
      break;
  }
  return "fault";
}

nlohmann::json send_json(const OptionSet& options, const SendSummary& summary) {
  nlohmann::json json = {{"command", "send"},
                         {"status", status_word(summary)},
                         {"options", options.used()},
                         {"sha256", summary.job.sha256},
                         {"bytes", summary.job.bytes},
                         {"seal_holds", seal_json(summary.seal_holds)},
                         {"program", facts_json(summary.facts)},
                         {"warnings", summary.findings.warnings}};
  if (summary.controller) {
    json["controller"] = {{"dialect", summary.controller->dialect.name},
                          {"version", summary.controller->version},
                          {"rx_bytes", summary.controller->rx_bytes},
                          {"planner_blocks", summary.controller->planner_blocks},
                          {"line_numbers", summary.controller->line_numbers}};
  }
  if (summary.checked_lines) json["checked_lines"] = *summary.checked_lines;
  if (summary.plan) {
    json["resumed"] = {{"line", summary.plan->line},
                       {"entry_line", summary.plan->entry_line},
                       {"overlap_end", summary.plan->overlap_end},
                       {"steps", summary.plan->steps}};
  }
  if (summary.result) json["result"] = result_json(*summary.result);
  return json;
}

std::string send_text(const SendSettings& settings, const SendSummary& summary) {
  std::string head = settings.file + ": " + status_word(summary);
  if (summary.result && !summary.result->done()) head += ": " + summary.result->reason;
  std::string text = printable_line(head);
  text.append("\n").append(facts_text(summary.facts));
  text.append("  seal         ").append(seal_words(summary.seal_holds)).append("\n");
  if (summary.checked_lines) {
    text += "  controller   checked " + std::to_string(*summary.checked_lines) + " lines ($C)\n";
  }
  if (summary.result) text += result_text(*summary.result);
  return text;
}

}  // namespace lensforge::app
