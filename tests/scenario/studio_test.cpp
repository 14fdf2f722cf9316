// SPDX-License-Identifier: GPL-3.0-or-later
// `lensforge studio` from outside: who is answered, what a picture goes through, what a killed
// studio keeps.
#include <httplib.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/temp_folder.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::Not;

/// A running studio and a browser that has opened its address.
class Browser {
 public:
  explicit Browser(const std::string& folder, const std::string& port = "0")
      : studio_(Arguments{"studio", folder, "--port", port}) {
    const std::string before = "http://127.0.0.1:";
    for (int i = 0; i < 100 && studio_.runs_for(milliseconds(100)); ++i) {
      const std::string said = studio_.said();
      const auto at = said.find(before);
      const auto key = said.find("?key=");
      if (at == std::string::npos || said.find('\n', key) == std::string::npos) continue;
      port_ = std::stoi(said.substr(at + before.size()));
      key_ = said.substr(key + 5, 32);
      break;
    }
    client_.emplace("127.0.0.1", port_);
    client_->set_read_timeout(30);
    cookie_ = "lensforge-" + std::to_string(port_) + "=" + key_;
  }

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] const std::string& key() const { return key_; }
  [[nodiscard]] const std::string& cookie() const { return cookie_; }
  Process& process() { return studio_; }
  httplib::Client& client() { return *client_; }

  httplib::Result get(const std::string& path) { return client_->Get(path, {{"Cookie", cookie_}}); }
  json state(const std::string& project) {
    return json::parse(get("/projects/" + project + "/state.json")->body);
  }
  httplib::Result post(const std::string& path, const std::string& body = "") {
    return client_->Post(path, httplib::Headers{{"Cookie", cookie_}, {"X-Lensforge", "studio"}},
                         body, "application/octet-stream");
  }
  httplib::Result post(const std::string& path, const json& body) {
    return post(path, body.dump());
  }
  /// A project with a picture of the fixtures as it is.
  std::string project(const std::string& name) {
    const auto made = post("/projects?title=" + name, testing::read_bytes(picture(name)));
    std::string own = json::parse(made->body)["name"];
    post("/projects/" + own + "/picture");
    return own;
  }
  /// The project's state once `there` is true of it; null after two minutes.
  json wait(const std::string& project, const std::function<bool(const json&)>& there) {
    for (int i = 0; i < 600; ++i) {
      json now = state(project);
      if (there(now)) return now;
      std::this_thread::sleep_for(milliseconds(200));
    }
    return nullptr;
  }
  json run(const std::string& project, const json& step) {
    post("/projects/" + project + "/run", step);
    return wait(project, [](const json& now) {
      const std::string status = now["job"]["status"];
      return status != "waiting" && status != "running" && status != "stopping";
    });
  }

 private:
  Process studio_;
  int port_ = 0;
  std::string key_;
  std::string cookie_;
  std::optional<httplib::Client> client_;
};

std::string error_of(const httplib::Result& answer) {
  return json::parse(answer->body).value("error", "");
}

using Studio = Scenario;

/// A small lens that takes seconds.
const json kSmall{{"settings", {{"--pixels", 24}, {"--width", 6}, {"--focal", 40}}}};

TEST_F(Studio, AnswersOnlyTheBrowserThatOpenedItsAddress) {
  Browser browser(path("studio"));
  auto& client = browser.client();
  EXPECT_EQ(client.Get("/")->status, 403);
  EXPECT_EQ(client.Get("/?key=00000000000000000000000000000000")->status, 403);
  EXPECT_EQ(client.Get("/studio.json")->status, 403);
  const auto page = client.Get("/?key=" + browser.key());
  EXPECT_EQ(page->status, 200);
  EXPECT_THAT(page->get_header_value("Set-Cookie"), HasSubstr("HttpOnly; SameSite=Strict"));
  EXPECT_EQ(browser.get("/studio.json")->status, 200);
  // Another site's name for this port, and another site's form.
  const httplib::Headers other{{"Host", "elsewhere.example"}, {"Cookie", browser.cookie()}};
  EXPECT_EQ(client.Get("/studio.json", other)->status, 403);
  const httplib::Headers form{{"Cookie", browser.cookie()}};
  EXPECT_EQ(client.Post("/projects?title=x", form, "bytes", "text/plain")->status, 403);
  // The key is the owner's.
  const auto allowed = fs::status(at("studio") / ".key").permissions();
  EXPECT_EQ(allowed & (fs::perms::group_all | fs::perms::others_all), fs::perms::none);
  browser.process().send(SIGINT);
  EXPECT_EQ(browser.process().wait(std::chrono::seconds(5)).exit_code, 0);
}

TEST_F(Studio, KeepsItsKeySoThatAnOpenPageSurvives) {
  std::string key;
  {
    Browser browser(path("studio"));
    key = browser.key();
  }
  Browser again(path("studio"));
  EXPECT_EQ(again.key(), key);
}

TEST_F(Studio, RefusesWhatIsNoPictureAndKeepsNothingOfIt) {
  Browser browser(path("studio"));
  const auto text = browser.post("/projects?title=notes.txt", std::string("no picture"));
  EXPECT_EQ(text->status, 400);
  EXPECT_THAT(error_of(text), HasSubstr("notes.txt"));
  EXPECT_THAT(error_of(text), Not(HasSubstr("original")));
  EXPECT_EQ(browser.post("/projects?title=empty.png", std::string())->status, 400);
  EXPECT_TRUE(json::parse(browser.get("/studio.json")->body)["projects"].empty());
  // Titles are names of folders inside, whatever they are.
  const std::string bytes = testing::read_bytes(picture("rings.png"));
  const auto odd = browser.post("/projects?title=..%2F..%2Fa%20b%00%22.png", bytes);
  const std::string name = json::parse(odd->body)["name"];
  EXPECT_EQ(name.find_first_of("/."), std::string::npos);
  EXPECT_TRUE(fs::exists(at("studio") / name / "studio.json"));
}

TEST_F(Studio, ARemovedProjectIsMovedAsideAndCanComeBack) {
  Browser browser(path("studio"));
  const fs::path aside = at("studio") / ".removed";
  const auto remove = [&](const std::string& name) {
    return browser.post("/projects/" + name + "/remove")->status;
  };
  const std::string name = browser.project("rings.png");
  EXPECT_EQ(remove(name), 200);
  EXPECT_EQ(browser.get("/projects/" + name + "/state.json")->status, 404);
  EXPECT_TRUE(json::parse(browser.get("/studio.json")->body)["projects"].empty());
  EXPECT_TRUE(fs::exists(aside / name / "studio.json"));
  // Another one of the same name goes beside it.
  EXPECT_EQ(browser.project("rings.png"), name);
  EXPECT_EQ(remove(name), 200);
  EXPECT_EQ(remove(name), 404);
  EXPECT_TRUE(fs::exists(aside / (name + "-2") / "studio.json"));
  fs::rename(aside / name, at("studio") / name);
  EXPECT_EQ(browser.get("/projects/" + name + "/state.json")->status, 200);
  // Not while something of it runs.
  browser.post("/projects/" + name + "/run", json{{"step", "design"}});
  EXPECT_EQ(remove(name), 400);
  EXPECT_TRUE(fs::exists(at("studio") / name / "studio.json"));
  browser.post("/projects/" + name + "/pause");
}

TEST_F(Studio, PrintsItsAddressEvenIfItIsToBeQuiet) {
  Process studio({"studio", path("studio"), "--port", "0", "--quiet"});
  for (int i = 0; i < 100 && !fs::exists(at("studio") / ".key"); ++i)
    studio.runs_for(milliseconds(100));
  studio.runs_for(milliseconds(300));
  studio.send(SIGINT);
  const Outcome outcome = studio.wait(std::chrono::seconds(5));
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("http://127.0.0.1:"));
  EXPECT_THAT(outcome.out, HasSubstr("/?key="));
}

TEST_F(Studio, ServesNothingOutsideOfItsProjects) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const fs::path folder = at("studio") / name;
  std::ofstream(at("secret.png")) << "secret";
  fs::create_symlink(at("secret.png"), folder / "link.png");
  const std::string files = "/projects/" + name + "/files/";
  EXPECT_EQ(browser.get(files + "picture.png")->status, 200);
  for (const char* path : {"../../secret.png", "..%2F..%2Fsecret.png", "%2e%2e/%2e%2e/secret.png",
                           "link.png", ".studio/lens-1.json", "", "//", "lens-1", "%00", "%"}) {
    EXPECT_EQ(browser.get(files + path)->status, 404) << path;
  }
  for (const char* path : {"/projects/../studio.json", "/projects/.key/state.json",
                           "/projects/none/state.json", "/none", "/projects/x"}) {
    EXPECT_EQ(browser.get(path)->status, 404) << path;
  }
}

TEST_F(Studio, NamesASettingsFaultAndKeepsWhatWasThere) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name + "/settings";
  EXPECT_EQ(browser.post(place, kSmall)->status, 200);
  const json before = browser.state(name);
  const auto refused = [&](const json& change, const std::string& words) {
    const auto answer = browser.post(place, change);
    EXPECT_EQ(answer->status, 400);
    EXPECT_THAT(error_of(answer), HasSubstr(words));
  };
  refused({{"settings", {{"--width", -3}}}}, "--width -3");
  refused({{"settings", {{"--focal", 60}, {"--pixels", "many"}}}}, "--pixels");
  refused({{"settings", {{"--out", "elsewhere"}}}}, "--out");
  refused({{"settings", {{"--lamp", "FILE:/etc/passwd:9mrad"}}}}, "--lamp");
  refused({{"workshop", {{"finish.pitch", 0}}}}, "finish.pitch");
  refused({{"workshop", {{"finish.pitch", "0.05"}, {"finish.none", 1}}}}, "finish.none");
  refused({{"workshop", {{"finish.tool", 77}}}}, "77");
  EXPECT_EQ(browser.post(place, std::string("{"))->status, 400);
  EXPECT_EQ(browser.state(name), before);
  // Valid on their own, contradictory together: said beside the sizes.
  browser.post(place, json{{"settings", {{"--focal", 2}}}});
  EXPECT_THAT(browser.state(name)["light"].value("error", ""), HasSubstr("--focal"));
}

TEST_F(Studio, SaysTheBlursBeforeAnyDesign) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  browser.post("/projects/" + name + "/settings",
               json{{"settings", {{"--lamp", "led:3mm@600mm"}, {"--focal", 200}}}});
  const json light = browser.state(name)["light"];
  EXPECT_EQ(light["setup"]["source"]["position"][2], -600.0);
  // The image of 3 mm through the middle of the lens, whose 5 mm are as 5 / 1.49 of air.
  const double pixel =
      light["setup"]["image_size"][0].get<double>() / light["pixels"][0].get<double>();
  const double image = 3.0 * (200.0 - 5.0) / (600.0 + 5.0 / 1.49);
  EXPECT_EQ(light["blurs"][0]["cause"], "lamp");
  EXPECT_NEAR(light["blurs"][0]["pixels"].get<double>(), image / pixel, 0.01);
}

TEST_F(Studio, TellsThePageWhereAMirrorsPictureIs) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const json mirror{{"--mode", "reflect"}, {"--incidence", 45}, {"--focal", 200}, {"--width", 50}};
  browser.post("/projects/" + name + "/settings", json{{"settings", mirror}});
  const json setup = browser.state(name)["light"]["setup"];
  EXPECT_EQ(setup["mode"], "reflect");
  // Light at 45 degrees goes as far to the right as up from the mirror, which is 5 mm thick.
  const double right = setup["screen"]["centre"][0].get<double>() - 25.0;
  EXPECT_NEAR(right, 195.0, 1e-6);
  EXPECT_NEAR(setup["source"]["direction"][0].get<double>(), std::sqrt(0.5), 1e-9);
}

TEST_F(Studio, LeadsFromPictureToASentProgram) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  EXPECT_EQ(browser.post(place + "/run", json{{"step", "cam"}})->status, 400);  // No lens yet.
  browser.post(place + "/settings", kSmall);
  json now = browser.run(name, {{"step", "design"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_LT(now["lens"]["mae"], 0.05);
  // The command that is shown is the one that ran: it makes the same bytes.
  const std::string command = now["job"]["command"];
  EXPECT_EQ(command, "lensforge design picture.png --focal 40 --pixels 24 --width 6 --out lens-1");
  run({"design", (at("studio") / name / "picture.png").string(), "--focal", "40", "--pixels", "24",
       "--width", "6", "--out", path("same")});
  EXPECT_EQ(testing::read_bytes(at("same") / "surface.ply"),
            testing::read_bytes(at("studio") / name / "lens-1" / "surface.ply"));

  EXPECT_THAT(error_of(browser.post(place + "/run", json{{"step", "cam-front"}})),
              HasSubstr("the front of this lens is flat"));
  now = browser.run(name, {{"step", "cam"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_LE(now["part"]["range"]["p10"], now["part"]["range"]["p90"]);
  EXPECT_EQ(now["part"]["programs"].back(), "finish.ngc");
  EXPECT_TRUE(now["part"]["current"]);
  now = browser.run(name, {{"step", "export"}, {"format", "step"}});
  EXPECT_EQ(now["job"]["status"], "done") << now["job"];
  const auto solid = browser.get(place + "/files/lens-1/lens.step");
  EXPECT_THAT(solid->body, HasSubstr("ISO-10303-21"));
  EXPECT_THAT(solid->get_header_value("Content-Disposition"), HasSubstr("lens.step"));

  // Ended by a key, then from the beginning at a thousand times the speed.
  browser.post(place + "/send", json{{"program", "finish.ngc"}, {"port", "sim:grbl@20x"}});
  now = browser.wait(name, [](const json& s) { return s["cut"]["state"] == "Run"; });
  EXPECT_EQ(browser.post(place + "/send", json{{"program", "rough.ngc"}})->status, 400);
  browser.post(place + "/key", json{{"key", "Q"}});
  now = browser.wait(name, [](const json& s) { return s["cut"]["status"] != "running"; });
  EXPECT_EQ(now["cut"]["status"], "interrupted") << now["cut"];
  EXPECT_FALSE(now["cut"]["unfinished"]);  // A simulation begins anew.
  // A machine does not: the page is told that there is a choice.
  const auto send = [&](const std::string& how) {
    browser.post(place + "/send",
                 json{{"program", "finish.ngc"}, {"port", path("no-machine")}, {"how", how}});
    return browser.wait(name, [](const json& s) { return s["cut"]["status"] != "running"; })["cut"];
  };
  json cut = send("");
  EXPECT_EQ(cut["status"], "failed") << cut;
  EXPECT_TRUE(cut["unfinished"]) << cut;
  EXPECT_THAT(cut["message"].get<std::string>(), HasSubstr("unfinished job"));
  cut = send("resume");
  EXPECT_THAT(cut["command"].get<std::string>(), HasSubstr("--resume"));
  EXPECT_THAT(cut["message"].get<std::string>(), HasSubstr("no-machine"));
  EXPECT_TRUE(cut["unfinished"]) << cut;
  browser.post(place + "/send", json{{"program", "finish.ngc"}, {"port", "sim:grbl@1000x"}});
  now = browser.wait(name, [](const json& s) { return s["cut"]["status"] != "running"; });
  EXPECT_EQ(now["cut"]["status"], "done") << now["cut"];
  EXPECT_EQ(now["cut"]["percent"], 100.0);
  EXPECT_EQ(now["cut"]["tool"].size(), 2U);
}

/// What a lens projects, in the middle of a dark wall.
std::string photo_of(const fs::path& picture, const fs::path& out) {
  constexpr int kBy = 6;
  const Image light = read_image(picture).image;
  Image photo(kBy * 2 * light.columns(), kBy * 2 * light.rows(), 0.01F);
  for (int r = 0; r < kBy * light.rows(); ++r) {
    for (int c = 0; c < kBy * light.columns(); ++c) {
      photo.at(c + photo.columns() / 4, r + photo.rows() / 4) += 0.7F * light.at(c / kBy, r / kBy);
    }
  }
  write_image(photo, out);
  return testing::read_bytes(out);
}

TEST_F(Studio, ChecksAPhotographOfTheWall) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  browser.post(place + "/settings", kSmall);
  browser.run(name, {{"step", "design"}});
  const auto early = browser.post(place + "/run", json{{"step", "check"}});
  EXPECT_THAT(error_of(early), HasSubstr("there is no photograph yet"));
  const auto text = browser.post(place + "/photo", std::string("no picture"));
  EXPECT_EQ(text->status, 400);
  EXPECT_EQ(error_of(text), "the photograph: no picture can be read from it");
  EXPECT_FALSE(browser.state(name)["photo"].get<bool>());
  const fs::path lens = at("studio") / name / "lens-1";
  browser.post(place + "/photo", photo_of(lens / "render.png", at("photo.png")));
  EXPECT_TRUE(browser.state(name)["photo"].get<bool>());
  EXPECT_TRUE(browser.state(name)["check"].is_null());
  const json now = browser.run(name, {{"step", "check"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_EQ(now["job"]["command"], "lensforge check lens-1 photo --out lens-1/check");
  EXPECT_FALSE(now["check"]["verdict"].get<std::string>().empty());
  EXPECT_EQ(now["check"]["pictures"].size(), 3U);
  EXPECT_EQ(browser.get(now["check"]["report"])->status, 200);
}

TEST_F(Studio, CutsAShapedFrontFirstAndOffersTheBack) {
  Browser browser(path("studio"));
  const std::string name = browser.project("portrait.png");
  const std::string place = "/projects/" + name;
  const json both{{"--pixels", 16},
                  {"--width", 6},
                  {"--focal", 40},
                  {"--faces", "two"},
                  {"--quality", "draft"}};
  const json quick{{"finish.pitch", 0.4}, {"semi.enabled", false}};
  browser.post(place + "/settings", json{{"settings", both}, {"workshop", quick}});
  json now = browser.run(name, {{"step", "design"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_TRUE(now["lens"]["two_faces"]);
  EXPECT_TRUE(now["front"].is_null());
  for (const json& picture : now["lens"]["pictures"]) {
    EXPECT_EQ(browser.get(picture["url"])->status, 200) << picture;
  }
  // A margin that leaves the frame, unless the workshop states one.
  const std::string back = now["commands"]["cam"];
  EXPECT_THAT(back, HasSubstr("--z-zero table --margin 6.6mm"));
  now = browser.run(name, {{"step", "cam-front"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_EQ(now["job"]["command"], now["commands"]["cam-front"]);
  EXPECT_THAT(now["job"]["command"].get<std::string>(), HasSubstr("--face front --margin 6.6mm"));
  EXPECT_THAT(now["front"]["faces"].dump(), HasSubstr("cut the back, too"));
  EXPECT_EQ(browser.get(now["front"]["report"])->status, 200);
  EXPECT_TRUE(now["front"]["current"]);
  for (const json& file : now["front"]["files"]) {
    EXPECT_EQ(browser.get(file["url"])->status, 200) << file;
  }
  EXPECT_EQ(now["front"]["programs"].back(), "cam-front/finish.ngc");
  EXPECT_TRUE(now["part"].is_null());
  browser.post(place + "/send",
               json{{"program", "cam-front/rough.ngc"}, {"port", "sim:grbl@1000x"}});
  now = browser.wait(name, [](const json& s) { return s["cut"]["status"] != "running"; });
  EXPECT_EQ(now["cut"]["status"], "done") << now["cut"];
  EXPECT_EQ(now["cut"]["program"], "cam-front/rough.ngc");
  EXPECT_THAT(now["cut"]["under"].get<std::string>(), HasSubstr("relief-front.png"));
  browser.post(place + "/settings", json{{"workshop", {{"stock.margin", 2}}}});
  now = browser.run(name, {{"step", "cam-front"}});
  EXPECT_EQ(now["job"]["status"], "failed") << now["job"];
  EXPECT_THAT(now["job"]["message"].get<std::string>(), HasSubstr("stock.margin 2"));
}

TEST_F(Studio, DesignsWithASecondPicture) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  const auto second = [&](const std::string& title, const std::string& bytes) {
    return browser.post(place + "/second?title=" + title, bytes);
  };
  const auto light = [&] { return browser.state(name)["light"]; };
  EXPECT_THAT(error_of(browser.post(place + "/settings", json{{"settings", {{"--second", true}}}})),
              HasSubstr("there is no second picture yet"));
  EXPECT_THAT(
      error_of(browser.post(place + "/settings", json{{"settings", {{"--second-focal", 90}}}})),
      HasSubstr("--second-focal: needs a second picture"));
  const auto text = second("notes.txt", "no picture");
  EXPECT_EQ(text->status, 400);
  EXPECT_THAT(error_of(text), HasSubstr("notes.txt"));
  EXPECT_THAT(error_of(text), Not(HasSubstr("second-")));
  EXPECT_TRUE(browser.state(name)["second"].is_null());

  EXPECT_EQ(second("relief.png", testing::read_bytes(picture("relief.png")))->status, 200);
  EXPECT_THAT(light().value("error", ""), HasSubstr("needs the place of its screen"));
  browser.post(place + "/settings", json{{"settings",
                                          {{"--pixels", 16},
                                           {"--width", 12},
                                           {"--thickness", 12},
                                           {"--focal", 30},
                                           {"--second-focal", 120},
                                           {"--quality", "draft"}}}});
  EXPECT_EQ(light()["setup"]["second"]["centre"][2], 120.0);
  const json now = browser.run(name, {{"step", "design"}});
  ASSERT_EQ(now["job"]["status"], "done") << now["job"];
  EXPECT_THAT(now["job"]["command"].get<std::string>(), HasSubstr("--second second-picture.png"));
  EXPECT_THAT(now["lens"]["words"].dump(), HasSubstr("second picture: MAE 0.0"));
  const std::string pictures = now["lens"]["pictures"].dump();
  EXPECT_THAT(pictures, HasSubstr("render.png"));
  EXPECT_THAT(pictures, HasSubstr("render_second.png"));

  EXPECT_EQ(second("long.png", testing::read_bytes(picture("calligraphy.png")))->status, 200);
  EXPECT_THAT(light().value("error", ""), HasSubstr("both pictures need the same proportions"));
  // Cropped, as the page does it.
  const std::string crop = testing::read_bytes(at("studio") / name / "picture.png");
  EXPECT_EQ(browser.post(place + "/second-picture", crop)->status, 200);
  EXPECT_FALSE(light().contains("error")) << light();
  // Without it nothing is left of its screen.
  browser.post(place + "/settings", json{{"settings", {{"--second", nullptr}}}});
  EXPECT_FALSE(browser.state(name)["settings"].contains("--second-focal"));
  EXPECT_FALSE(light().contains("error")) << light();
}

TEST_F(Studio, GoesBackToAnEarlierLensAndItsSettings) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  browser.post(place + "/settings", kSmall);
  browser.run(name, {{"step", "design"}});
  browser.post(place + "/settings", json{{"settings", {{"--focal", 50}}}});
  json now = browser.run(name, {{"step", "design"}});
  EXPECT_EQ(now["lens"]["version"], 2);
  now = json::parse(browser.post(place + "/undo")->body);
  EXPECT_EQ(now["lens"]["version"], 1);
  EXPECT_EQ(now["settings"]["--focal"], 40);
  EXPECT_EQ(browser.post(place + "/undo")->status, 400);
  now = json::parse(browser.post(place + "/redo")->body);
  EXPECT_EQ(now["lens"]["version"], 2);
  EXPECT_EQ(now["settings"]["--focal"], 50);
}

TEST_F(Studio, KeepsTheLensWhenTheNextDesignIsRefused) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  browser.post(place + "/settings", kSmall);
  browser.run(name, {{"step", "design"}});
  browser.post(place + "/settings", json{{"settings", {{"--focal", 2}}}});
  json now = browser.run(name, {{"step", "design"}});
  EXPECT_EQ(now["job"]["status"], "failed");
  EXPECT_THAT(now["job"]["message"].get<std::string>(), HasSubstr("--focal"));
  EXPECT_EQ(now["lens"]["version"], 1);
  EXPECT_EQ(now["settings"]["--focal"], 2);
}

/// A design of some minutes.
const json kLong{{"settings", {{"--pixels", 128}, {"--quality", "paper"}}}};

TEST_F(Studio, PausesWithinASecondAndGoesOn) {
  Browser browser(path("studio"));
  const std::string name = browser.project("rings.png");
  const std::string place = "/projects/" + name;
  browser.post(place + "/settings", kLong);
  browser.post(place + "/run", json{{"step", "design"}});
  json now = browser.wait(name, [](const json& s) { return !s["job"]["live"].is_null(); });
  EXPECT_EQ(browser.get(now["job"]["live"]["picture"])->status, 200);
  EXPECT_EQ(browser.post(place + "/run", json{{"step", "design"}})->status, 400);
  const auto start = std::chrono::steady_clock::now();
  browser.post(place + "/pause");
  now = browser.wait(name, [](const json& s) { return s["job"]["status"] == "paused"; });
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(3));
  now = json::parse(browser.post(place + "/continue")->body);
  EXPECT_THAT(now["job"]["command"].get<std::string>(), HasSubstr("--resume"));
  browser.wait(name, [](const json& s) { return s["job"]["status"] == "running"; });
}

TEST_F(Studio, AKilledStudioLosesNothing) {
  std::string name;
  {
    Browser browser(path("studio"));
    name = browser.project("rings.png");
    browser.post("/projects/" + name + "/settings", kLong);
    browser.post("/projects/" + name + "/run", json{{"step", "design"}});
    browser.wait(name, [](const json& s) { return !s["job"]["live"].is_null(); });
    browser.process().send(SIGKILL);
    browser.process().wait();
  }
  Browser again(path("studio"));
  json now = again.state(name);
  EXPECT_EQ(now["job"]["status"], "interrupted");
  EXPECT_EQ(now["settings"], kLong["settings"]);
  // The design that lost its studio lets go of the folder within a second.
  std::this_thread::sleep_for(std::chrono::seconds(2));
  again.post("/projects/" + name + "/continue");
  now =
      again.wait(name, [](const json& s) { return !s["job"]["words"].get<std::string>().empty(); });
  EXPECT_EQ(now["job"]["status"], "running") << now["job"];
}

TEST_F(Studio, RefusesAPortOrFolderThatItCannotHave) {
  std::ofstream(at("file")) << "x";
  const Outcome file = run({"studio", path("file"), "--port", "0"});
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_THAT(file.err, HasSubstr("FOLDER"));
  Browser browser(path("studio"));
  const Outcome taken = run({"studio", path("other"), "--port", std::to_string(browser.port())});
  EXPECT_EQ(taken.exit_code, 2);
  EXPECT_THAT(taken.err, HasSubstr("in use"));
  EXPECT_EQ(run({"studio", "--port", "70000"}).exit_code, 2);
}

}  // namespace
}  // namespace lensforge::scenario
