// SPDX-License-Identifier: GPL-3.0-or-later
// `lensforge design --live`: what it serves, and the stop button of its page in a real browser.
#include <httplib.h>

#include <csignal>
#include <cstdlib>
#include <stop_token>
#include <system_error>
#include <thread>
#include <vector>

#include "app/view/browser.h"
#include "app/view/page_client.h"
#include "core/stop_bound.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A long design that is shown at `port`.
Arguments live_design(const std::string& out, const std::string& port) {
  return {"design", picture("rings.png"), "--out", out,         "--pixels", "64",     "--rounds",
          "200",    "--levels",           "3",     "--threads", "1",        "--live", port};
}

/// The port at which a design shows itself, by what it says; 0 if it does not within a minute.
int port_of(Process& design) {
  const std::string before = "http://127.0.0.1:";
  for (int i = 0; i < 600 && design.runs_for(std::chrono::milliseconds(100)); ++i) {
    const std::string said = design.said();
    const auto at = said.find(before);
    if (at != std::string::npos) return std::stoi(said.substr(at + before.size()));
  }
  return 0;
}

/// Asks until the design has a state or ends; waits for up to a minute.
nlohmann::json first_state(Process& design, httplib::Client& client) {
  for (int i = 0; i < 600 && design.runs_for(std::chrono::milliseconds(100)); ++i) {
    const auto answer = client.Get("/state.json");
    if (answer && answer->status == 200) return nlohmann::json::parse(answer->body);
  }
  return nullptr;
}

/// Opens what is served at a port in a browser and writes what became of the page to a file, when
/// the page's clock, which waits for answers, says 3 s.
void open_in_browser(int port, const std::string& file) {
  const std::string command =
      "timeout 60 chromium --headless --no-sandbox --virtual-time-budget=3000 --dump-dom "
      "http://127.0.0.1:" +
      std::to_string(port) + "/ >" + file + " 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
}

/// The page of a design with its stop button pressed at once, at an address of its own.
class PressedPage {
 public:
  explicit PressedPage(httplib::Client& design) {
    std::string page = design.Get("/")->body;
    page.insert(page.rfind("</body>"),
                "<script>document.querySelector('[data-stop]').click();</script>");
    server_.Get("/", [page](const auto&, auto& response) {
      response.set_content(page, "text/html; charset=utf-8");
    });
    server_.Post("/stop", [&design](const auto& request, auto& response) {
      const auto answer = design.Post(
          "/stop", httplib::Headers{{"X-Lensforge", request.get_header_value("X-Lensforge")}}, "",
          "text/plain");
      response.status = answer ? answer->status : 500;
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
  }
  ~PressedPage() {
    server_.stop();
    thread_.join();
  }
  PressedPage(const PressedPage&) = delete;
  PressedPage& operator=(const PressedPage&) = delete;

  [[nodiscard]] int port() const { return port_; }

 private:
  httplib::Server server_;
  int port_ = 0;
  std::thread thread_;
};

/// 40 clients that send a header line again and again; who is dropped comes back.
class SlowClients {
 public:
  explicit SlowClients(int port)
      : thread_([port](const std::stop_token& stop) {
          std::vector<testing::PageClient> clients;
          while (!stop.stop_requested()) {
            try {
              while (clients.size() < 40) clients.emplace_back(port).send("GET / HTTP/1.1\r\n");
            } catch (const std::system_error&) {
              return;  // The design has ended.
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(300));
            std::erase_if(clients, [](testing::PageClient& client) {
              client.send("X: y\r\n");
              client.receive(std::chrono::milliseconds(0));
              return client.closed();
            });
          }
        }) {}

 private:
  std::jthread thread_;
};

using Live = Scenario;

TEST_F(Live, ServesPicturesAndErrorOfTheDesignToItsOwnPageAlone) {
  Process design(live_design(path("lens"), "0"));
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  httplib::Client client("127.0.0.1", port);
  const nlohmann::json state = first_state(design, client);
  ASSERT_TRUE(state.is_object());
  EXPECT_GT(state["mae"].get<double>(), 0.0);
  EXPECT_THAT(state["words"].get<std::string>(), HasSubstr("round "));
  for (const char* name : {"/picture.png", "/target.png", "/error.png"}) {
    EXPECT_THAT(client.Get(name)->body, StartsWith("\x89PNG")) << name;
  }
  EXPECT_THAT(client.Get("/")->body, HasSubstr("Stop and keep what there is"));
  EXPECT_EQ(client.Get("/", httplib::Headers{{"Host", "elsewhere.example"}})->status, 403);
  EXPECT_EQ(client.Post("/stop", "", "text/plain")->status, 403);
  // A page in use by one design is refused to another, which writes nothing.
  expect_refusal(run(live_design(path("other"), std::to_string(port))), 2,
                 {"--live " + std::to_string(port) + ": the port is in use"});
  EXPECT_FALSE(fs::exists(at("other")));
}

TEST_F(Live, CtrlCEndsItThoughABrowserHoldsAConnectionAndItsPortIsFreeAtOnce) {
  Process design(live_design(path("lens"), "0"));
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  httplib::Client client("127.0.0.1", port);
  client.set_keep_alive(true);
  ASSERT_TRUE(first_state(design, client).is_object());
  design.send(SIGINT);
  EXPECT_EQ(design.wait(testing::kStopBound).exit_code, 130);
  Process next(live_design(path("other"), std::to_string(port)));
  EXPECT_EQ(port_of(next), port) << next.said();
}

TEST_F(Live, CtrlCEndsItWhateverItsClientsDo) {
  Process design(live_design(path("lens"), "0"));
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  const SlowClients slow(port);
  std::vector<testing::PageClient> half_open;
  for (int i = 0; i < 300; ++i) half_open.emplace_back(port).send("GET / HT");
  httplib::Client client("127.0.0.1", port);
  ASSERT_TRUE(first_state(design, client).is_object());
  design.send(SIGINT);
  EXPECT_EQ(design.wait(testing::kStopBound).exit_code, 130);
}

TEST_F(Live, EndsWithTheDesignWhateverItsClientsDo) {
  Process design({"design", picture("rings.png"), "--out", path("lens"), "--pixels", "32",
                  "--rounds", "3", "--threads", "1", "--live", "0"});
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  const SlowClients slow(port);
  EXPECT_EQ(design.wait(std::chrono::seconds(60)).exit_code, 0);
}

TEST_F(Live, ItsPageShowsTheDesignInABrowser) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  Process design(live_design(path("lens"), "0"));
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  httplib::Client client("127.0.0.1", port);
  ASSERT_TRUE(first_state(design, client).is_object());
  open_in_browser(port, path("page.html"));
  const std::string page = content(at("page.html"));
  EXPECT_NE(page.find(" at work, "), std::string::npos);
  EXPECT_NE(page.find("src=\"/picture.png?"), std::string::npos);
}

TEST_F(Live, ItsStopButtonEndsTheDesignAsCtrlCDoes) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  Process design(live_design(path("lens"), "0"));
  const int port = port_of(design);
  ASSERT_GT(port, 0) << design.said();
  httplib::Client client("127.0.0.1", port);
  ASSERT_TRUE(first_state(design, client).is_object());
  open_in_browser(PressedPage(client).port(), "/dev/null");
  const Outcome outcome = design.wait();
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_THAT(outcome.err, HasSubstr("--resume"));
  EXPECT_TRUE(fs::exists(at("lens/checkpoint.bin")));
  EXPECT_EQ(nlohmann::json::parse(content(at("lens/lens.json")))["provenance"]["status"],
            "interrupted");
}

TEST_F(Live, RefusesWhatIsNoPort) {
  for (const char* port : {"70000", "-1", "http", "80.5"}) {
    expect_refusal(
        run({"design", picture("rings.png"), "--out", path("lens"), std::string("--live=") + port}),
        2, {"--live", port});
  }
  EXPECT_FALSE(fs::exists(at("lens")));
}

}  // namespace
}  // namespace lensforge::scenario
