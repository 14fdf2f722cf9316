// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/live_server.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/view/loopback_server.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/page/drawings.h"
#include "core/page/html_page.h"
#include "core/spline/control_net.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/render.h"
#include "design/schedule/checkpoint.h"
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
  return !saved.convergence.empty() && saved.convergence.back().stage == kSplineStage;
}

Image picture_of(const Checkpoint& saved, const DesignGoalView& goal, const Executor& executor) {
  Image picture;
  if (is_spline(saved)) {
    const SampledSurface nodes = spline_nodes({saved.mesh.grid, saved.mesh.vertices}, kMeshSamples);
    evaluate(nodes.mesh, nodes.normals, goal.setup, goal.target, &picture, executor);
    return picture;
  }
  const bool facets = goal.model == SurfaceModel::kFacet;
  evaluate(saved.mesh, goal.setup, facets ? SurfaceModel::kFacet : SurfaceModel::kSmooth,
           goal.target, &picture, executor);
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
  const Image picture = picture_of(saved, goal, executor);
  const std::size_t rounds = rounds_of(saved);
  const nlohmann::json state{{"number", number},
                             {"rounds", rounds},
                             {"mae", compare(picture, goal.target).mae},
                             {"plot", plot_of(saved)},
                             {"words", "round " + std::to_string(rounds + 1) + " at work, " +
                                           duration_text(saved.seconds / 60.0) + " so far"}};
  return {number, state.dump(), bytes_of(grey_picture(picture)),
          bytes_of(error_image(picture, goal.target))};
}

}  // namespace lensforge
