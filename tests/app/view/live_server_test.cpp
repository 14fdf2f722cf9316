// SPDX-License-Identifier: GPL-3.0-or-later
// Answers of the page of a running design; no client can keep it from answering others or from
// ending.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "app/view/loopback_server.h"
#include "app/view/page_client.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/temp_folder.h"
#include "design/design.h"
#include "design/schedule/checkpoint.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using testing::ask;
using ::testing::HasSubstr;
using testing::kPromptly;
using testing::page_request;
using testing::PageAnswer;
using testing::PageClient;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// A server whose target is of `bytes` bytes, which are no picture: it sends them as they are.
class Served {
 public:
  explicit Served(std::size_t bytes = 6000) {
    server_.emplace(0, "rings", std::string(bytes, 'p'), [this] { ++stops_; });
    const std::string address = server_->address();
    port_ = std::stoi(address.substr(address.rfind(':') + 1));
  }
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] int stops() const { return stops_; }
  LiveServer& server() { return *server_; }
  PageAnswer get(const std::string& path) const {
    return ask(port_, page_request(port_, "GET " + path));
  }
  /// How long the end takes.
  Clock::duration end() {
    const auto start = Clock::now();
    server_.reset();
    return Clock::now() - start;
  }

 private:
  std::atomic<int> stops_ = 0;
  int port_ = 0;
  std::optional<LiveServer> server_;
};

std::vector<PageClient> clients_that_send(int port, std::size_t count, const std::string& bytes) {
  std::vector<PageClient> clients;
  for (std::size_t i = 0; i < count; ++i) clients.emplace_back(port).send(bytes);
  return clients;
}

constexpr const char* kOwn = "X-Lensforge: stop\r\n";

TEST(LiveServer, ServesPageAndPicturesToItsOwnAddress) {
  Served live;
  EXPECT_THAT(live.get("/").body, HasSubstr("Stop and keep what there is"));
  EXPECT_EQ(live.get("/target.png").body, std::string(6000, 'p'));
  EXPECT_EQ(live.get("/state.json").status, 404);
  live.server().publish({1, "{}", "a picture", "its error"});
  EXPECT_EQ(live.get("/state.json").body, "{}");
  EXPECT_EQ(live.get("/picture.png?1").body, "a picture");
  EXPECT_EQ(live.get("/error.png?1").body, "its error");
  const std::string by_name =
      "GET / HTTP/1.1\r\nHost: localhost:" + std::to_string(live.port()) + "\r\n\r\n";
  EXPECT_EQ(ask(live.port(), by_name).status, 200);
}

TEST(LiveServer, StopsOnceHoweverOftenItIsAsked) {
  const Served live;
  const std::string length = "Content-Length: 4096\r\n";
  for (int i = 0; i < 3; ++i) {
    const std::string request = page_request(live.port(), "POST /stop", kOwn + length);
    EXPECT_EQ(ask(live.port(), request + std::string(4096, 'b')).status, 200);
  }
  EXPECT_EQ(live.stops(), 1);
}

/// Every answer that there is, by the requests that lead to it.
std::vector<std::pair<int, std::string>> refused_requests(int port) {
  const auto with = [port](const std::string& lines) { return page_request(port, "GET /", lines); };
  const auto post = [port](const std::string& lines) {
    return page_request(port, "POST /stop", lines);
  };
  const std::string own = "Host: 127.0.0.1:" + std::to_string(port) + "\r\n";
  return {{400, "GET / HTTP/1.1\r\n\r\n"},
          {400, with(own)},
          {400, with("Host: elsewhere.example\r\n")},
          {400, "GET /\r\n\r\n"},
          {400, "GET / HTTP/0.9\r\n" + own + "\r\n"},
          {400, "GET / HTTP/2.0\r\n" + own + "\r\n"},
          {400, "GET / HTTP/1.1\r\nHost\r\n\r\n"},
          {400, std::string("\0\x01\xFF no request\r\n\r\n", 16)},
          {400, post("Content-Length: -1\r\n")},
          {400, post("Content-Length: +5\r\n")},
          {400, post("Content-Length: 0x10\r\n")},
          {400, post("Content-Length: 5, 6\r\n")},
          {400, post("Content-Length: 5\r\nContent-Length: 6\r\n")},
          {400, post("Content-Length: 99999999999999999999999\r\n")},
          {400, post("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n")},
          {403, "GET / HTTP/1.1\r\nHost: elsewhere.example\r\n\r\n"},
          {403, "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"},
          {403, post("")},
          {403, post("Content-Length: 400000000\r\n")},
          {404, page_request(port, "GET /../../etc/passwd")},
          {404, page_request(port, "GET http://elsewhere.example/")},
          {404, page_request(port, "GET /stop")},
          {404, page_request(port, "POST /", kOwn)},
          {405, page_request(port, "HEAD /")},
          {405, page_request(port, "OPTIONS /stop")},
          {405, page_request(port, "DELETE /")},
          {411, post(std::string(kOwn) + "Transfer-Encoding: chunked\r\n")},
          {413, post(std::string(kOwn) + "Content-Length: 4097\r\n")},
          {431, page_request(port, "GET /" + std::string(1'000'000, 'a'))},
          {431, with("X: " + std::string(9000, 'x') + "\r\n")}};
}

TEST(LiveServer, RefusesByTheHeaderAlone) {
  const Served live;
  for (const auto& [status, request] : refused_requests(live.port())) {
    EXPECT_EQ(ask(live.port(), request).status, status) << request.substr(0, 200);
  }
  EXPECT_EQ(live.stops(), 0);
}

TEST(LiveServer, EveryAnswerForbidsFramesGuessedTypesAndOtherOrigins) {
  const Served live;
  auto requests = refused_requests(live.port());
  requests.emplace_back(200, page_request(live.port()));
  requests.emplace_back(200, page_request(live.port(), "GET /target.png"));
  for (const auto& [status, request] : requests) {
    const std::string head = ask(live.port(), request).head;
    for (const char* line :
         {"Content-Security-Policy: frame-ancestors 'none'\r\n", "X-Frame-Options: DENY\r\n",
          "Cross-Origin-Resource-Policy: same-origin\r\n", "X-Content-Type-Options: nosniff\r\n",
          "Cache-Control: no-store\r\n"}) {
      EXPECT_THAT(head, HasSubstr(line)) << status << " " << request.substr(0, 200);
    }
  }
}

TEST(LiveServer, ReadsLittleOfABodyThatItRefuses) {
  const Served live;
  PageClient client(live.port());
  client.send("POST /stop HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(live.port()) +
              "\r\nOrigin: http://elsewhere.example\r\nContent-Length: 400000000\r\n\r\n");
  const std::string piece(1'000'000, 'b');
  int pieces = 0;
  while (pieces < 400 && client.send(piece) == piece.size()) ++pieces;
  EXPECT_LT(pieces, 50);  // Sockets on both sides hold some MB.
  EXPECT_THAT(client.receive(), HasSubstr("403"));
  EXPECT_EQ(live.stops(), 0);
}

TEST(LiveServer, SendsAPictureOnceHoweverManyRangesAreAskedFor) {
  const Served live;
  std::string ranges = "Range: bytes=0-";
  for (int i = 0; i < 1000; ++i) ranges += ",0-";
  const PageAnswer answer =
      ask(live.port(), page_request(live.port(), "GET /target.png", ranges + "\r\n"));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body.size(), 6000U);
}

TEST(LiveServer, AnswersOneRequestOfAConnection) {
  const Served live;
  const std::string again = page_request(live.port(), "POST /stop", kOwn);
  const PageAnswer answer =
      ask(live.port(), page_request(live.port(), "GET /target.png",
                                    "Content-Length: " + std::to_string(again.size()) + "\r\n") +
                           again + again);
  EXPECT_EQ(answer.body.size(), 6000U);
  EXPECT_THAT(answer.head, HasSubstr("Connection: close\r\n"));
  EXPECT_EQ(live.stops(), 0);
}

TEST(LiveServer, HasTheTimeOfAHeaderForAllItsLines) {
  const Served live;
  PageClient slow(live.port());
  const auto start = Clock::now();
  slow.send("GET / HTTP/1.1\r\n");
  while (!slow.closed() && Clock::now() - start < std::chrono::seconds(6)) {
    slow.send("X: y\r\n");
    slow.receive(milliseconds(100));
  }
  EXPECT_TRUE(slow.closed());
  EXPECT_GT(Clock::now() - start, std::chrono::seconds(1));
}

TEST(LiveServer, AnswersOthersWhile300ClientsHaveSentHalfARequest) {
  const Served live;
  auto clients = clients_that_send(live.port(), 300, "GET / HTTP/1.1\r\nHo");
  for (int i = 0; i < 20; ++i) EXPECT_EQ(live.get("/target.png").status, 200);
  const auto open = std::count_if(clients.begin(), clients.end(), [](PageClient& client) {
    client.receive(milliseconds(0));
    return !client.closed();
  });
  EXPECT_LE(open, 32);
}

/// Of an answer this large the sockets hold a part only.
constexpr std::size_t kLarge = 50'000'000;

TEST(LiveServer, AnswersOthersWhile100ClientsDoNotReadTheirAnswers) {
  const Served live(kLarge);
  const auto clients =
      clients_that_send(live.port(), 100, page_request(live.port(), "GET /target.png"));
  for (int i = 0; i < 20; ++i) EXPECT_EQ(live.get("/").status, 200);
}

TEST(LiveServer, EndsPromptlyWhateverItsClientsWaitFor) {
  Served live(kLarge);
  const int port = live.port();
  const auto silent = clients_that_send(port, 8, "");
  const auto half = clients_that_send(port, 8, "GET / HTTP/1.1\r\nHo");
  const auto reading = clients_that_send(port, 8, page_request(port, "GET /target.png"));
  const auto sending =
      clients_that_send(port, 8, page_request(port, "POST /stop", "Content-Length: 400000000\r\n"));
  EXPECT_EQ(live.get("/").status, 200);
  EXPECT_LT(live.end(), kPromptly);
}

TEST(LiveServer, ServesOnWhenTheProcessCanOpenFilesAgain) {
  const Served live;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const std::string request = page_request(live.port(), "GET /target.png");
  const int last = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  ::close(last);
  {
    // The one file that is left goes to the client.
    const rlimit none_left{static_cast<rlim_t>(last) + 1, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none_left), 0);
    PageClient unheard(live.port());
    unheard.send(request);
    EXPECT_EQ(unheard.receive(milliseconds(300)), "");
    ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
    EXPECT_THAT(unheard.receive(), HasSubstr("200 OK"));
  }
  EXPECT_EQ(ask(live.port(), request).status, 200);
}

TEST(LiveServer, RandomBytesKeepItNeitherFromAnsweringNorFromEnding) {
  fuzz::Random random(20);
  Served live;
  std::vector<PageClient> clients;
  for (int round = 0; round < 300; ++round) {
    for (std::size_t i = random.below(8); i > 0; --i) {
      clients.emplace_back(live.port())
          .send(testing::hostile_request(live.port(), random), milliseconds(20));
    }
    // Some clients leave, in any order; the others keep their connections.
    while (clients.size() > 100) {
      std::swap(clients[random.below(clients.size())], clients.back());
      clients.pop_back();
    }
    ASSERT_EQ(live.get("/target.png").status, 200) << "round " << round;
  }
  EXPECT_EQ(live.stops(), 0);
  EXPECT_LT(live.end(), kPromptly);
}

TEST(LiveServer, RefusesAPortThatIsInUse) {
  const Served live;
  EXPECT_THROW(LiveServer(live.port(), "rings", "", [] {}), InputError);
}

/// A design that is stopped when it has reported so many iterations on the picture.
void stop_design(const Image& picture, const DesignOptions& options, int iterations) {
  std::stop_source stop;
  int seen = 0;
  const RunControl control(stop.get_token(), [&](const Progress& p) {
    if (p.detail.starts_with("MAE") && ++seen == iterations) stop.request_stop();
  });
  ASSERT_EQ(design_lens(picture, options, Executor::serial(), control).status,
            DesignResult::Status::kInterrupted);
}

DesignOptions small_design(const testing::TempFolder& folder) {
  DesignOptions options;
  options.pixels = 16;
  options.width = 12.0;
  options.focal_length = 15.0;
  options.iterations = 10;
  options.checkpoint = folder / "checkpoint";
  return options;
}

double mae_of(const LiveState& state) {
  return nlohmann::json::parse(state.json)["mae"].get<double>();
}

TEST(LiveState, HasThePictureBehindTheFrontThatTheDesignHasShaped) {
  const testing::TempFolder folder;
  const Image picture = testing::spot_picture(16, 16);
  DesignOptions options = small_design(folder);
  options.light.both_faces = true;
  stop_design(picture, options, 12);
  // The page knows the options, which have no front yet.
  const DesignGoalView goal{working_picture(picture, options, {}), optical_setup(options, {16, 16}),
                            options.model};
  ASSERT_FALSE(goal.setup.front);
  const auto mae = [&] {
    return mae_of(state_of_design(options.checkpoint, goal, 1, Executor::serial()));
  };
  EXPECT_LT(mae(), 0.03);
  Checkpoint flat = read_checkpoint(options.checkpoint);
  flat.shared_front.reset();
  write_checkpoint(flat, options.checkpoint);
  EXPECT_GT(mae(), 0.05);
}

TEST(LiveState, OfTwoPicturesHasBothScreens) {
  const testing::TempFolder folder;
  const Image picture = testing::spot_picture(16, 16);
  Image other(16, 16, 0.5F);
  for (int i = 0; i < 16; ++i) other.at(i, 4) = 0.7F;
  DesignOptions options = small_design(folder);
  options.thickness = 12.0;
  options.focal_length = 30.0;
  options.second.picture = std::make_shared<const Image>(other);
  options.second.focal_length = 120.0;
  stop_design(picture, options, 60);
  const DesignGoalView goal{working_picture(picture, options, {}), optical_setup(options, {16, 16}),
                            options.model, working_picture(other, options, {})};
  const LiveState state = state_of_design(options.checkpoint, goal, 1, Executor::serial());
  EXPECT_LT(mae_of(state), 0.05);
  testing::write_bytes(folder / "second.png", state.second);
  const Image shown = read_image(folder / "second.png").image;
  EXPECT_LT(compare(shown, *goal.second).mae, 0.05);
  EXPECT_GT(compare(shown, goal.target).mae, 0.1);
}

}  // namespace
}  // namespace lensforge
