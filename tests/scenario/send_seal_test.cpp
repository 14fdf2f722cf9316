// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/files.h"
#include "machine/gcode/program_seal.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

const std::string kBody =
    "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX50 F600\nG0 Z5\nM5\nM2\n";

/// Programs with the seal that cam writes.
class SendSeal : public Scenario {
 protected:
  /// `body` below the seal of kBody.
  void write_program(const std::string& body) const {
    Sha256 hash;
    hash.update(kBody);
    std::string program = "(job)\n(";
    program.append(seal_text(hash.finish())).append(")\n").append(body);
    write(at("job.ngc"), program);
  }
  [[nodiscard]] Outcome send(const Arguments& more) const {
    Arguments arguments = {"send", path("job.ngc"), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
};

TEST_F(SendSeal, AProgramAsCamWroteItIsSentAndSaysSo) {
  write_program(kBody);
  const Outcome outcome = send({"--port", "sim:grbl", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["seal_holds"], true);
  EXPECT_EQ(outcome.json()["result"]["executed"], 10);
}

TEST_F(SendSeal, AProgramThatWasChangedOrCutShortIsRefused) {
  std::vector<std::string> bodies{kBody + "\n", kBody.substr(1), ""};
  for (std::size_t i = 3; i < kBody.size(); i += 30) {
    bodies.push_back(kBody.substr(0, i));
    bodies.push_back(kBody);
    bodies.back()[i] = static_cast<char>(bodies.back()[i] ^ 1);
  }
  for (const std::string& body : bodies) {
    write_program(body);
    expect_refusal(send({"--dry-run"}), 2, {"job.ngc", "seal", "changed or cut short"});
  }
}

TEST_F(SendSeal, AProgramWithMotionAtOrAboveTheSealIsRefused) {
  write_program(kBody);
  const std::string whole = content(at("job.ngc"));
  const std::size_t body = whole.find(kBody);
  const std::size_t seal = whole.find("(sha256");
  std::string cam = whole;
  cam.insert(0, "(units: mm; X0 Y0: lower left corner of the lens)\n");
  for (const std::string& program :
       {"G0 Z-9\n" + whole, whole.substr(0, seal) + "G0 Z-9\n" + whole.substr(seal),
        whole.substr(0, body - 1) + " G0 Z-9\n" + kBody, "(a)\rG0 Z-9\r" + whole,
        cam.substr(0, cam.find("(sha256")) + kBody}) {
    write(at("job.ngc"), program);
    expect_refusal(send({"--port", "sim:grbl"}), 2, {"job.ngc", "seal", "changed or cut short"});
  }
}

TEST_F(SendSeal, IsToldBeforeTheControllerIsTouched) {
  write_program(kBody.substr(0, kBody.size() - 4));  // Without its end.
  expect_refusal(send({"--port", "/dev/no-such-port"}), 2, {"job.ngc", "seal"});
  EXPECT_FALSE(fs::exists(at("job.ngc.journal")));
  EXPECT_THAT(content(at("job.ngc.log")), HasSubstr("nothing was sent"));
}

TEST_F(SendSeal, AChangeThatIsMeantIsAWarning) {
  std::string body = kBody;
  body.replace(body.find("F600"), 4, "F500");
  write_program(body);
  const Outcome outcome =
      run({"send", path("job.ngc"), "--port", "sim:grbl", "--allow-changed", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning"));
  EXPECT_EQ(outcome.json()["seal_holds"], false);
  EXPECT_THAT(content(at("job.ngc.log")), HasSubstr("changed or cut short"));
}

TEST_F(SendSeal, InfoTellsOfIt) {
  write_program(kBody);
  EXPECT_EQ(run({"info", path("job.ngc"), "--json"}).json()["seal_holds"], true);
  write_program(kBody + "M2\n");
  EXPECT_EQ(run({"info", path("job.ngc"), "--json"}).json()["seal_holds"], false);
  EXPECT_THAT(run({"info", path("job.ngc")}).out, HasSubstr("broken"));
  write(at("job.ngc"), kBody);
  EXPECT_EQ(run({"info", path("job.ngc"), "--json"}).json()["seal_holds"], nullptr);
}

TEST_F(SendSeal, AProgramWithoutOneIsSent) {
  write(at("job.ngc"), kBody);
  const Outcome outcome = send({"--dry-run"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("cannot tell whether the program was changed"));
}

}  // namespace
}  // namespace lensforge::scenario
