// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/loopback_server.h"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/optics/front.h"
#include "core/page/drawings.h"
#include "core/page/html_page.h"
#include "core/spline/control_net.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/energy/two_face_objective.h"
#include "design/render.h"
#include "design/schedule/checkpoint.h"
#include "view_files.h"

namespace lensforge {

// Built on Boost.Beast: one thread that no socket blocks, a time for a whole header, a decision
// before the body. cpp-httplib cannot hold such limits: its times are for one read, each client
// holds one of its threads, and none of its hooks closes a client's socket.

namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::beast::error_code;
using tcp = asio::ip::tcp;

/// A browser on the same machine sends a header of 1 kB at once.
constexpr std::chrono::seconds kHeaderTime{2};
constexpr std::uint32_t kMaxHeader = 8192;  ///< Bytes.
/// Bytes of a body that is dropped; a page sends none.
constexpr std::size_t kMaxDropped = 4096;
/// For an answer of some MB over loopback, which takes milliseconds, to a busy browser; and for
/// every further kAnswerBytes.
constexpr std::chrono::seconds kAnswerTime{5};
constexpr std::size_t kAnswerBytes = 4'000'000;
/// For a photograph of 100 MB from a slow disk.
constexpr std::chrono::seconds kBodyTime{60};
/// A browser opens 6.
constexpr std::size_t kMaxConnections = 32;
/// Until the next try where the process can open no more files.
constexpr std::chrono::milliseconds kAcceptPause{100};

/// Browsers send this header for scripts of the page itself alone.
constexpr const char* kOwnHeader = "X-Lensforge";

using Request = http::request<http::empty_body>;

/// A page's own address counts, whatever name led to this port: no other page may read or stop a
/// design.
bool is_own(std::string_view host, int port) {
  const std::string number = std::to_string(port);
  return host == "127.0.0.1:" + number || host == "localhost:" + number;
}

/// Error status of a complete header; ok if it is valid. @param max_body  of a POST, bytes.
http::status verdict(const Request& request, std::uint64_t body, int port, std::size_t max_body) {
  if (request.count(http::field::host) != 1) return http::status::bad_request;
  const auto host = request[http::field::host];
  if (!is_own({host.data(), host.size()}, port)) return http::status::forbidden;
  const bool post = request.method() == http::verb::post;
  if (!post && request.method() != http::verb::get) return http::status::method_not_allowed;
  if (post && request.count(kOwnHeader) == 0) return http::status::forbidden;
  if (request.chunked()) return http::status::length_required;
  const std::size_t most = post && max_body > 0 ? max_body : kMaxDropped;
  return body > most ? http::status::payload_too_large : http::status::ok;
}

/// Status for a header that could not be read; unknown if no answer is possible.
http::status verdict(error_code error) {
  const error_code ended = make_error_code(http::error::end_of_stream);
  if (error == ended || error.category() != ended.category()) return http::status::unknown;
  const bool too_long = error == http::error::header_limit || error == http::error::buffer_overflow;
  return too_long ? http::status::request_header_fields_too_large : http::status::bad_request;
}

/// One client. It lives as long as it waits for something.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, int port, std::size_t max_body,
             const LoopbackServer::Answer& answer)
      : stream_(std::move(socket)), port_(port), max_body_(max_body), answer_(answer) {}

  void read() {
    parser_.header_limit(kMaxHeader);
    // verdict() applies the limit: a client without permission is refused first.
    parser_.body_limit(std::numeric_limits<std::uint64_t>::max());
    stream_.expires_after(kHeaderTime);
    http::async_read_header(
        stream_, buffer_, parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->decide(error); });
  }
  [[nodiscard]] bool idle() const { return idle_; }
  void close() { stream_.close(); }

 private:
  void decide(error_code error) {
    const http::status status =
        error ? verdict(error)
              : verdict(parser_.get(), parser_.content_length().value_or(0), port_, max_body_);
    if (status == http::status::unknown) return;
    if (status != http::status::ok) return write({.status = static_cast<unsigned>(status)});
    const bool post = parser_.get().method() == http::verb::post;
    if (post && max_body_ > 0) return read_body();
    respond(parser_.get(), {});
  }

  void read_body() {
    idle_ = false;
    whole_.emplace(std::move(parser_));
    whole_->body_limit(max_body_);
    stream_.expires_after(kBodyTime);
    http::async_read(stream_, buffer_, *whole_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       const auto& request = self->whole_->get();
                       if (!error) self->respond(request, request.body());
                     });
  }

  void respond(const http::request_header<>& header, std::string_view body) {
    const bool post = header.method() == http::verb::post;
    const std::string_view all(header.target().data(), header.target().size());
    const std::size_t end = std::min(all.find('?'), all.size());
    const auto cookie = header[http::field::cookie];
    LoopbackAnswer answer = answer_({post,
                                     all.substr(0, end),
                                     all.substr(std::min(end + 1, all.size())),
                                     {cookie.data(), cookie.size()},
                                     body});
    if (answer.bytes == nullptr && answer.status == static_cast<unsigned>(http::status::ok)) {
      answer.status = static_cast<unsigned>(http::status::not_found);
    }
    write(std::move(answer));
  }

  void write(LoopbackAnswer answer) {
    idle_ = false;
    bytes_ = std::move(answer.bytes);
    const auto status = static_cast<http::status>(answer.status);
    response_.result(status);
    response_.keep_alive(false);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Content-Security-Policy", "frame-ancestors 'none'");
    response_.set(http::field::x_frame_options, "DENY");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Referrer-Policy", "no-referrer");
    if (!answer.cookie.empty()) response_.set(http::field::set_cookie, answer.cookie);
    if (!answer.file_name.empty()) {
      response_.set(http::field::content_disposition,
                    "attachment; filename=\"" + answer.file_name + "\"");
    }
    if (status == http::status::method_not_allowed) response_.set(http::field::allow, "GET, POST");
    if (bytes_ != nullptr) {
      response_.set(http::field::content_type, answer.type);
      response_.body() = {bytes_->data(), bytes_->size()};
    }
    response_.prepare_payload();
    const std::size_t size = bytes_ ? bytes_->size() : 0;
    stream_.expires_after(kAnswerTime + std::chrono::seconds(size / kAnswerBytes));
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (!error) self->finish();
                      });
  }

  /// Closing a socket with unread bytes resets the connection, and with that the client may lose
  /// the answer: a body of the allowed size is read and dropped.
  void finish() {
    idle_ = true;
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    drop();
  }
  void drop() {
    stream_.async_read_some(asio::buffer(dropped_),
                            [self = shared_from_this()](error_code error, std::size_t count) {
                              self->dropped_count_ += count;
                              if (!error && self->dropped_count_ <= kMaxDropped) self->drop();
                            });
  }

  boost::beast::tcp_stream stream_;
  int port_;
  std::size_t max_body_;
  const LoopbackServer::Answer& answer_;
  bool idle_ = true;
  boost::beast::flat_buffer buffer_{kMaxHeader};
  http::request_parser<http::empty_body> parser_;
  std::optional<http::request_parser<http::string_body>> whole_;
  std::shared_ptr<const std::string> bytes_;
  http::response<http::span_body<const char>> response_;
  std::array<char, kMaxDropped> dropped_{};
  std::size_t dropped_count_ = 0;
};

}  // namespace

class LoopbackServer::Listener {
 public:
  Listener(int port, std::size_t max_body, Answer answer)
      : answer_(std::move(answer)), max_body_(max_body) {
    acceptor_.open(tcp::v4());
    // A port whose last connections have just been closed is free; one with a server is not.
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind({asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port)});
    acceptor_.listen();
    port_ = acceptor_.local_endpoint().port();
    accept();
    thread_ = std::thread([this] { run(); });
  }
  ~Listener() {
    context_.stop();
    thread_.join();
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  [[nodiscard]] int port() const { return port_; }

 private:
  void run() {
    while (!context_.stopped()) {
      try {
        context_.run();
      } catch (const std::exception&) {
        // Memory that one client's answer lacks ends this client's connection, not the design.
      }
    }
  }

  void accept() {
    acceptor_.async_accept([this](error_code error, tcp::socket socket) {
      if (error) return accept_later();
      accept();
      admit(std::move(socket));
    });
  }
  void accept_later() {
    pause_.expires_after(kAcceptPause);
    pause_.async_wait([this](error_code) { accept(); });
  }

  void admit(tcp::socket socket) {
    std::erase_if(connections_, [](const auto& connection) { return connection.expired(); });
    if (connections_.size() >= kMaxConnections) close_oldest();
    const auto connection =
        std::make_shared<Connection>(std::move(socket), port_, max_body_, answer_);
    connections_.push_back(connection);
    connection->read();
  }
  void close_oldest() {
    const auto idle =
        std::find_if(connections_.begin(), connections_.end(),
                     [](const auto& connection) { return connection.lock()->idle(); });
    const auto oldest = idle != connections_.end() ? idle : connections_.begin();
    oldest->lock()->close();
    connections_.erase(oldest);
  }

  Answer answer_;
  std::size_t max_body_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  std::vector<std::weak_ptr<Connection>> connections_;  ///< In the order of their arrival.
  int port_ = 0;
  std::thread thread_;
};

LoopbackServer::LoopbackServer(const LoopbackOptions& options, Answer answer) try
    : listener_(std::make_unique<Listener>(options.port, options.max_body, std::move(answer))) {
} catch (const boost::system::system_error&) {
  throw InputError(options.option + " " + std::to_string(options.port) +
                   ": the port is in use or not allowed; " + options.option +
                   " 0 takes a free one");
}

LoopbackServer::~LoopbackServer() = default;

int LoopbackServer::port() const { return listener_->port(); }

std::string LoopbackServer::address() const {
  return "http://127.0.0.1:" + std::to_string(port()) + "/";
}

int loopback_port(const std::string& option, const std::string& text) {
  constexpr int kLargest = 65535;
  int port = -1;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  if (error == std::errc() && stop == end && port >= 0 && port <= kLargest) return port;
  throw InputError(option + " " + printable_line(text) +
                   ": must be a port, 1 to 65535, or 0 for a free one; 8080 works");
}

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

/// The served content and the server. Everything except publish() is called by the server's thread.
class LiveServer::Content {
 public:
  Content(int port, std::string page, std::string target, std::function<void()> stop)
      : page_(std::make_shared<const std::string>(std::move(page))),
        target_(std::make_shared<const std::string>(std::move(target))),
        stop_(std::move(stop)),
        server_({port, "--live"},
                [this](const LoopbackRequest& request) { return answer(request); }) {}

  [[nodiscard]] std::string address() const { return server_.address(); }
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
  /// Null before the first state.
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

std::string LiveServer::address() const { return content_->address(); }

void LiveServer::publish(LiveState state) { content_->publish(std::move(state)); }

namespace {

/// Points of the curve of errors: more than a screen has columns.
constexpr std::size_t kMaxPoints = 2000;
constexpr const char* kSplineStage = "spline";

bool is_spline(const Checkpoint& saved) {
  if (saved.front.size() > 0) return true;
  return !saved.convergence.empty() && saved.convergence.back().stage == kSplineStage;
}

/// The setup with the front as the design has shaped it.
OpticalSetup setup_of(const Checkpoint& saved, OpticalSetup setup) {
  if (saved.front.size() > 0) setup.front = height_front(saved.front, setup.lens_size);
  if (saved.shared_front) {
    setup.front =
        HeightFront{std::make_shared<const HeightSpline>(*saved.shared_front), setup.lens_size};
  }
  return setup;
}

/// A picture as the surface makes it so far. @param setup  with its front and the picture's screen.
Image picture_of(const Checkpoint& saved, const OpticalSetup& setup, const DesignGoalView& goal,
                 const Image& target, const Executor& executor) {
  Image picture;
  if (is_spline(saved)) {
    const SampledSurface nodes = spline_nodes({saved.mesh.grid, saved.mesh.vertices}, kMeshSamples);
    evaluate(nodes.mesh, nodes.normals, setup, target, &picture, executor);
    return picture;
  }
  const bool facets = goal.model == SurfaceModel::kFacet;
  evaluate(saved.mesh, setup, facets ? SurfaceModel::kFacet : SurfaceModel::kSmooth, target,
           &picture, executor);
  return picture;
}

/// MAE over seconds, of the steps that have a picture.
std::string plot_of(const Checkpoint& saved) {
  PlotCurve curve{"", {}};
  const std::size_t step = 1 + saved.convergence.size() / kMaxPoints;
  for (std::size_t i = 0; i < saved.convergence.size(); i += step) {
    const ConvergenceRow& row = saved.convergence[i];
    if (row.mae > 0.0) curve.points.emplace_back(row.seconds, row.mae);
  }
  return decade_plot({curve}, "Mean absolute error over seconds of the design");
}

std::size_t rounds_of(const Checkpoint& saved) {
  std::set<std::pair<int, int>> rounds;
  for (const ConvergenceRow& row : saved.convergence) rounds.emplace(row.level, row.round);
  return rounds.size();
}

std::string bytes_of(const ColorImage& image) {
  const std::vector<unsigned char> png = encode_png(image);
  return {png.begin(), png.end()};
}

}  // namespace

LiveState state_of_design(const std::filesystem::path& checkpoint, const DesignGoalView& goal,
                          std::int64_t number, const Executor& executor) {
  const Checkpoint saved = read_checkpoint(checkpoint);
  const OpticalSetup setup = setup_of(saved, goal.setup);
  const Image picture = picture_of(saved, setup, goal, goal.target, executor);
  const std::size_t rounds = rounds_of(saved);
  const nlohmann::json state{{"number", number},
                             {"rounds", rounds},
                             {"mae", compare(picture, goal.target).mae},
                             {"plot", plot_of(saved)},
                             {"words", "round " + std::to_string(rounds + 1) + " at work, " +
                                           duration_text(saved.seconds / 60.0) + " so far"}};
  LiveState live{number, state.dump(), bytes_of(grey_picture(picture)),
                 bytes_of(error_image(picture, goal.target)), ""};
  if (goal.second) {
    const OpticalSetup far = on_second_screen(setup);
    live.second = bytes_of(grey_picture(picture_of(saved, far, goal, *goal.second, executor)));
  }
  return live;
}

}  // namespace lensforge
