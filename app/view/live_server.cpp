// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/live_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <chrono>
#include <future>
#include <mutex>
#include <utility>

#include "core/error.h"
#include "core/page/html_page.h"
#include "core/page/html_text.h"
#include "core/text/version.h"
#include "view_files.h"

namespace lensforge {
namespace {

constexpr const char* kHost = "127.0.0.1";

/// How long an idle connection of a browser is kept, and with it the end of a design at most.
constexpr std::chrono::seconds kIdle{1};

/// Without SO_REUSEPORT, which httplib sets: a second server would share the port. A port whose
/// last connections have just been closed is free.
void take_port_alone(socket_t socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

/// A page's own address counts, whatever name led to this port: no other page may read or stop a
/// design.
bool is_own(const httplib::Request& request, int port) {
  const std::string host = request.get_header_value("Host");
  const std::string number = std::to_string(port);
  return host == joined({kHost, ":", number}) || host == joined({"localhost:", number});
}

/// Browsers send this header for scripts of the page itself alone.
constexpr const char* kOwnHeader = "X-Lensforge";

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

struct LiveServer::Listener {
  httplib::Server server;
  int port = 0;
  std::mutex mutex;
  LiveState state;
  std::once_flag stopped;
  std::future<void> listening;

  void answer(const char* path, const char* type, std::string LiveState::*member) {
    server.Get(path, [this, type, member](const httplib::Request&, httplib::Response& response) {
      const std::lock_guard lock(mutex);
      if ((state.*member).empty()) {
        response.status = 404;
        return;
      }
      response.set_content(state.*member, type);
    });
  }
};

LiveServer::LiveServer(int port, const std::string& name, std::string target,
                       std::function<void()> stop)
    : listener_(std::make_unique<Listener>()) {
  Listener& l = *listener_;
  l.server.set_socket_options(take_port_alone);
  l.server.set_keep_alive_timeout(kIdle.count());
  l.server.set_default_headers({{"Cache-Control", "no-store"}});
  l.server.set_pre_routing_handler([&l](const auto& request, auto& response) {
    if (is_own(request, l.port)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    return httplib::Server::HandlerResponse::Handled;
  });
  l.server.Get("/", [page = live_page(name)](const auto&, auto& response) {
    response.set_content(page, "text/html; charset=utf-8");
  });
  l.server.Get("/target.png", [bytes = std::move(target)](const auto&, auto& response) {
    response.set_content(bytes, "image/png");
  });
  l.answer("/state.json", "application/json", &LiveState::json);
  l.answer("/picture.png", "image/png", &LiveState::picture);
  l.answer("/error.png", "image/png", &LiveState::error);
  l.server.Post("/stop", [&l, stop = std::move(stop)](const auto& request, auto& response) {
    if (!request.has_header(kOwnHeader)) {
      response.status = 403;
      return;
    }
    std::call_once(l.stopped, stop);
    response.set_content("{}", "application/json");
  });
  const bool bound = port == 0 ? (l.port = l.server.bind_to_any_port(kHost)) > 0
                               : l.server.bind_to_port(kHost, l.port = port);
  if (!bound) {
    throw InputError("--live " + std::to_string(port) +
                     ": the port is in use or not allowed; --live 0 takes a free one");
  }
  l.listening = std::async(std::launch::async, [&l] { l.server.listen_after_bind(); });
}

LiveServer::~LiveServer() {
  // stop() is heard by a server that listens: it may be just beginning to, or have ended by itself.
  Listener& l = *listener_;
  constexpr std::chrono::milliseconds kLook{1};
  while (!l.server.is_running() && l.listening.wait_for(kLook) == std::future_status::timeout) {
  }
  l.server.stop();
  l.listening.wait();
}

std::string LiveServer::address() const {
  return joined({"http://", kHost, ":", std::to_string(listener_->port), "/"});
}

void LiveServer::publish(LiveState state) {
  const std::lock_guard lock(listener_->mutex);
  listener_->state = std::move(state);
}

}  // namespace lensforge
