// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/job_events.h"

#include <utility>

#include "core/error.h"

namespace lensforge::app {
namespace {

std::string kind_word(SendEventKind kind) {
  switch (kind) {
    case SendEventKind::kStatus:
      return "status";
    case SendEventKind::kNote:
      return "note";
    case SendEventKind::kReading:
      return "reading";
    case SendEventKind::kStop:
      break;
  }
  return "stop";
}

template <class Value>
nlohmann::json or_null(const std::optional<Value>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

template <class Vector>
nlohmann::json list_of(const std::optional<Vector>& value) {
  if (!value) return nullptr;
  return {value->x(), value->y(), value->z()};
}

nlohmann::json standing_json(const SendEvent& event, const JobView& view, double left) {
  nlohmann::json json = {{"state", state_name(event.report.state)},
                         {"seconds", event.seconds},
                         {"line", event.acknowledged},
                         {"sent", event.sent},
                         {"executed", event.executed},
                         {"percent", 100.0 * share_of(event, view)},
                         {"left", left},
                         {"position", list_of(event.position)},
                         {"feed", or_null(event.report.feed)},
                         {"rpm_asked", event.rpm_asked},
                         {"rpm", event.rpm_seen},
                         {"overrides", list_of(event.report.overrides)},
                         {"inputs", event.report.pins}};
  const auto& room = event.report.room;
  json["free"] =
      room ? nlohmann::json{{"motions", room->blocks}, {"bytes", room->bytes}} : nlohmann::json();
  return json;
}

/// As write() makes them.
bool begins_events(std::string_view line) {
  const nlohmann::json first = nlohmann::json::parse(line, nullptr, false);
  const auto is_text = [&](const char* key) {
    return first.contains(key) && first[key].is_string();
  };
  return first.is_object() && is_text("event") && is_text("file") && is_text("sha256") &&
         is_text("time") && begins_with_time(first["time"].get<std::string>());
}

constexpr SinkKind kEvents{"events file", begins_events};

}  // namespace

JobEvents::JobEvents(const SendSettings& settings, Warn warn) : warn_(std::move(warn)) {
  if (settings.events.empty()) return;
  try {
    file_ = TextSink(settings.events, kEvents);
  } catch (const InputError& refused) {
    throw InputError(std::string("--events: ") + refused.what());
  }
}

void JobEvents::begin(const JobIdentity& job, const JobView& view) {
  job_ = job;
  view_ = view;
  SendEvent nothing;
  nothing.byte = view.first_byte;
  last_ = standing_json(nothing, view, view.estimate);
  last_["state"] = nullptr;
  nlohmann::json object = last_;
  object["event"] = "begin";
  object["lines"] = view.lines;
  object["bytes"] = view.bytes;
  object["estimate"] = view.estimate;
  write(std::move(object));
}

void JobEvents::take(const SendEvent& event, double left) {
  if (!file_.open()) return;
  last_ = standing_json(event, view_, left);
  nlohmann::json object = last_;
  object["event"] = kind_word(event.kind);
  if (!event.message.empty()) object["message"] = event.message;
  write(std::move(object));
}

void JobEvents::end(const SendResult& result) {
  nlohmann::json object = last_;
  object["event"] = "end";
  object["status"] = status_word(result.status);
  object["cause"] = cause_name(result.cause);
  object["message"] = result.reason;
  object["seconds"] = result.seconds;
  object["line"] = result.acknowledged;
  object["sent"] = result.sent;
  object["executed"] = result.executed;
  object["at_rest"] = result.at_rest;
  write(std::move(object));
}

void JobEvents::write(nlohmann::json object) {
  if (!file_.open()) return;
  object["time"] = time_stamp();
  object["file"] = job_.name;
  object["sha256"] = job_.sha256;
  if (const long lost = file_.take_lost(); lost > 0) object["lost"] = lost;
  const auto replace = nlohmann::json::error_handler_t::replace;
  const std::string failure = file_.write(object.dump(-1, ' ', false, replace));
  if (!failure.empty()) warn_("warning: the events end here: " + failure);
}

}  // namespace lensforge::app
