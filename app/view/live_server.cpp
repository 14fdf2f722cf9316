// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/live_server.h"

#include <mutex>
#include <string_view>
#include <utility>

#include "app/view/loopback_server.h"
#include "core/page/html_page.h"
#include "core/page/html_text.h"
#include "core/text/version.h"
#include "view_files.h"

namespace lensforge {
namespace {

std::string live_page(const std::string& name) {
  PageContent content;
  content.title = name + " – design";
  content.head =
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src 'self'; "
      "connect-src 'self'; style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n" +
      element("style", "", "\n" + std::string(view_files::kStyle));
  content.header = element("h1", "", escape_html(name)) + element("p", "data-round", "begins");
  content.body = std::string(view_files::kLiveBody);
  content.footer = escape_html("Served by " + program_mark() + " while the design runs");
  content.script =
      "(function () {\n\"use strict\";\n" + std::string(view_files::kLiveScript) + "})();\n";
  return html_page(content);
}

}  // namespace

/// What is served, and the server. Everything but publish() is called by the server's thread.
class LiveServer::Content {
 public:
  Content(int port, std::string page, std::string target, std::function<void()> stop)
      : page_(std::make_shared<const std::string>(std::move(page))),
        target_(std::make_shared<const std::string>(std::move(target))),
        stop_(std::move(stop)),
        server_(port, [this](const LoopbackRequest& request) { return answer(request); }) {}

  [[nodiscard]] int port() const { return server_.port(); }
  void publish(LiveState state) {
    const std::lock_guard lock(mutex_);
    state_ = std::make_shared<const LiveState>(std::move(state));
  }

 private:
  LoopbackAnswer answer(const LoopbackRequest& request) {
    if (request.post) return request.path == "/stop" ? stop_once() : LoopbackAnswer{};
    if (request.path == "/") return {"text/html; charset=utf-8", page_};
    if (request.path == "/target.png") return {"image/png", target_};
    if (request.path == "/state.json") return {"application/json", shown(&LiveState::json)};
    if (request.path == "/picture.png") return {"image/png", shown(&LiveState::picture)};
    if (request.path == "/error.png") return {"image/png", shown(&LiveState::error)};
    return {};
  }
  /// Nothing before the first state.
  std::shared_ptr<const std::string> shown(std::string LiveState::*part) {
    const std::lock_guard lock(mutex_);
    if ((*state_.*part).empty()) return nullptr;
    return {state_, &(*state_.*part)};
  }
  LoopbackAnswer stop_once() {
    if (const auto stop = std::exchange(stop_, nullptr)) stop();
    return {"application/json", std::make_shared<const std::string>("{}")};
  }

  std::shared_ptr<const std::string> page_;
  std::shared_ptr<const std::string> target_;
  std::function<void()> stop_;
  std::mutex mutex_;
  std::shared_ptr<const LiveState> state_ = std::make_shared<const LiveState>();
  LoopbackServer server_;  ///< Last, so that it ends first.
};

LiveServer::LiveServer(int port, const std::string& name, std::string target,
                       std::function<void()> stop)
    : content_(
          std::make_unique<Content>(port, live_page(name), std::move(target), std::move(stop))) {}

LiveServer::~LiveServer() = default;

std::string LiveServer::address() const {
  return joined({"http://127.0.0.1:", std::to_string(content_->port()), "/"});
}

void LiveServer::publish(LiveState state) { content_->publish(std::move(state)); }

}  // namespace lensforge
