// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/campaign_run.h"

#include <algorithm>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "fuzz/child.h"
#include "fuzz/live_clients.h"
#include "fuzz/oracles.h"
#include "fuzz/sandbox.h"
#include "fuzz/scene.h"
#include "fuzz/served_port.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

/// Every kind as often as its share, or only the one that is asked for.
std::vector<Kind> deck_of(const Campaign& campaign) {
  std::vector<Kind> cards;
  std::string names;
  for (const auto& kinds : {design_kinds(), lens_kinds(), cam_kinds(), coupon_kinds(), mesh_kinds(),
                            send_kinds(), reflect_kinds(), batch_kinds(), world_kinds()}) {
    for (const Kind& kind : kinds) {
      names += std::string("\n  ") + kind.name;
      const bool wanted = campaign.kind.empty() || campaign.kind == kind.name;
      if (wanted) cards.insert(cards.end(), static_cast<std::size_t>(kind.share), kind);
    }
  }
  if (cards.empty()) throw std::runtime_error("no kind '" + campaign.kind + "' among" + names);
  return cards;
}

/// Well mixed: a stride that shares no divisor with the number of cards.
Kind kind_of_run(const Campaign& campaign, std::uint64_t index) {
  const std::vector<Kind> deck = deck_of(campaign);
  constexpr std::uint64_t kStride = 10'007;  // A prime far above the number of cards.
  return deck[(index * kStride) % deck.size()];
}

/// A word as bash takes it.
std::string quoted(const std::string& word) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("-_./:=,@+").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string text = "$'";
  for (const char c : word) {
    static const char* const kDigits = "01234567";
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 32 && byte < 127 && c != '\'' && c != '\\') {
      text += c;
    } else {
      text += {'\\', kDigits[byte >> 6U], kDigits[(byte >> 3U) & 7U], kDigits[byte & 7U]};
    }
  }
  return text + "'";
}

std::string stream_words(const Command& command) {
  const auto word = [](const std::string& usual, Stream stream) -> std::string {
    const std::string target = stream == Stream::kClosed ? "&-"
                               : stream == Stream::kFull ? "/dev/full"
                                                         : "(nobody)";
    return stream == Stream::kUsual ? "" : " " + usual + target;
  };
  return word("<", command.in) + word(">", command.out) + word("2>", command.err);
}

std::string shell_line(const Plan& plan) {
  std::string line;
  for (const Command& command : plan.commands) {
    if (!line.empty()) line += " & ";
    if (command.file_size_limit > 0) {
      line += "prlimit --fsize=" + std::to_string(command.file_size_limit) + " ";
    }
    line += "lensforge";
    for (const std::string& word : command.arguments) line += " " + quoted(word);
    line += stream_words(command);
  }
  if (plan.interrupt_after > 0.0) {
    line += "  # signal " + std::to_string(plan.signal) + " after " +
            std::to_string(plan.interrupt_after) + " s";
  }
  return line;
}

std::vector<Ending> carry_out(const Plan& plan, double budget, const fs::path& folder) {
  std::vector<std::unique_ptr<Child>> children;
  for (const Command& command : plan.commands) {
    const std::string name = "record-" + std::to_string(children.size());
    children.push_back(std::make_unique<Child>(command, folder / "sandbox", folder / name));
  }
  const double patience = plan.interrupt_after > 0.0 ? plan.interrupt_after : budget;
  std::vector<Ending> endings;
  for (const auto& child : children) endings.push_back(child->wait(patience, plan.signal));
  return endings;
}

/// What a machine must not have done.
void check_machine(const Plan& plan, const std::vector<Ending>& endings, ServedPort& port,
                   std::vector<std::string>& wrong) {
  const ServedPort::Record record = port.finish();
  const auto asked = [](const Ending& ending) { return ending.asked != 0; };
  const bool may_hold = std::any_of(endings.begin(), endings.end(), asked);
  if (plan.must_refuse && record.pieces > 0) {
    wrong.push_back("UNSAFE: the machine made " + std::to_string(record.pieces) + " moves");
  }
  for (const std::string& event : record.events) {
    if (event.starts_with("error") || (event == "hold" && !may_hold)) {
      wrong.push_back("UNSAFE: something else than the program reached the port: " + event);
    }
  }
}

/// `info` must read what a command has just written.
void check_product(const Plan& plan, const std::vector<Ending>& endings, const fs::path& folder,
                   std::vector<std::string>& wrong) {
  const auto failed = [](const Ending& e) { return e.exit_code != 0 && e.exit_code != 3; };
  if (plan.product.empty() || std::all_of(endings.begin(), endings.end(), failed)) return;
  const Ending read =
      run_to_end({.arguments = {"info", plan.product}}, folder / "sandbox", folder / "record-info");
  if (read.exit_code != 0) {
    wrong.push_back("info does not accept " + plan.product + ": " + read.err.substr(0, 200));
  }
}

/// Folders, files and links; what else there was, what.txt tells.
void copy_readable(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const auto& at : fs::directory_iterator(from)) {
    const fs::path copy = to / at.path().filename();
    if (at.is_symlink()) {
      fs::copy_symlink(at.path(), copy);
    } else if (at.is_directory()) {
      copy_readable(at.path(), copy);
    } else if (at.is_regular_file()) {
      fs::copy_file(at.path(), copy);
    }
  }
}

void keep(const Campaign& campaign, const RunResult& result, const fs::path& folder) {
  const fs::path kept = campaign.kept / ("run-" + std::to_string(result.run));
  fs::remove_all(kept);
  copy_readable(folder, kept);
  std::ofstream note(kept / "what.txt");
  note << result.kind << "\n" << result.command << "\n";
  for (const std::string& wrong : result.wrong) note << wrong << "\n";
  note << repeat_line(campaign, result.run) << "\n";
}

/// The plan of run `index`, its sandbox made.
Plan planned(const Campaign& campaign, const BaseSet& base, std::uint64_t index,
             const fs::path& folder) {
  Random random(seed_of_run(campaign.seed, index));
  const Kind kind = kind_of_run(campaign, index);
  fs::create_directories(folder / "sandbox");
  Scene scene(base, folder / "sandbox", random);
  kind.make(scene);
  scene.plan.kind = kind.name;
  for (Command& command : scene.plan.commands) command.exec |= campaign.exec;
  return scene.plan;
}

void connect(Plan& plan, const std::string& port) {
  for (Command& command : plan.commands) {
    std::replace(command.arguments.begin(), command.arguments.end(), std::string("{PORT}"), port);
  }
}

/// Carries the plan out and holds it against all rules.
void judge(const Campaign& campaign, Plan plan, const fs::path& folder, RunResult& result) {
  std::optional<ServedPort> port;
  if (plan.serial_port) connect(plan, port.emplace().path());
  std::optional<LiveClients> clients;
  if (plan.page_clients) {
    connect(plan, std::to_string(clients.emplace(*plan.page_clients).port()));
  }
  const Snapshot before = snapshot(folder / "sandbox");
  const std::vector<Ending> endings = carry_out(plan, campaign.budget, folder);
  result.wrong = wrong_files(plan, endings, before, snapshot(folder / "sandbox"));
  for (std::size_t i = 0; i < endings.size(); ++i) {
    const Ending& ending = endings[i];
    const auto more = wrong_endings(plan, plan.commands[i], ending);
    result.wrong.insert(result.wrong.end(), more.begin(), more.end());
    result.codes.push_back(ending.signal != 0 ? -ending.signal : ending.exit_code);
    result.seconds = std::max(result.seconds, ending.seconds);
    result.stop_seconds = std::max(result.stop_seconds, ending.stop_seconds);
  }
  check_product(plan, endings, folder, result.wrong);
  if (port) check_machine(plan, endings, *port, result.wrong);
  if (clients && clients->unanswered()) {
    result.wrong.emplace_back("the page does not answer a proper request");
  }
}

}  // namespace

nlohmann::json to_json(const RunResult& result) {
  return {{"run", result.run},         {"kind", result.kind},
          {"command", result.command}, {"codes", result.codes},
          {"seconds", result.seconds}, {"stop_seconds", result.stop_seconds},
          {"wrong", result.wrong}};
}

RunResult result_of(const nlohmann::json& json) {
  return {json["run"],     json["kind"],         json["command"], json["codes"],
          json["seconds"], json["stop_seconds"], json["wrong"]};
}

std::string repeat_line(const Campaign& campaign, std::uint64_t index) {
  const std::string kind =
      campaign.kind.empty() ? "" : "LENSFORGE_CAMPAIGN_KIND='" + campaign.kind + "' ";
  return kind + "LENSFORGE_CAMPAIGN_SEED=" + std::to_string(campaign.seed) +
         " LENSFORGE_CAMPAIGN_ONLY=" + std::to_string(index) + " build/release/tests/fuzz_tests";
}

RunResult run_one(const Campaign& campaign, const BaseSet& base, std::uint64_t index,
                  const fs::path& folder) {
  const fs::path own = folder / ("run-" + std::to_string(index));
  RunResult result;
  result.run = index;
  Plan plan = planned(campaign, base, index, own);
  result.kind = plan.kind;
  result.command = shell_line(plan);
  judge(campaign, std::move(plan), own, result);
  if (!result.wrong.empty()) keep(campaign, result, own);
  fs::remove_all(own);
  return result;
}

}  // namespace lensforge::fuzz
