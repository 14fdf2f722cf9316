// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <sstream>

#include "core/error.h"
#include "core/temp_folder.h"
#include "machine/guard/register_map.h"
#include "machine/guard_clock.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;

std::string plc_text() { return testing::read_bytes(find_register_map("generic_plc")); }

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string refusal_of(const std::string& text) {
  return message_of<InputError>([&] { (void)parse_register_map(text, "mine.toml"); });
}

TEST(RegisterMap, ShippedMapsAreThese) {
  EXPECT_THAT(shipped_register_maps(), ElementsAre("delta_ms300", "delta_vfd_b", "generic_plc",
                                                   "h100", "siemens_v20", "yl620"));
}

TEST(RegisterMap, HoldsWhatTheFileSays) {
  const RegisterMap map = testing::shipped_map("yl620");
  EXPECT_EQ(map.name, "YL620");
  EXPECT_FALSE(map.transport.is_tcp);
  EXPECT_EQ(map.transport.baud, 9600);
  EXPECT_EQ(map.transport.parity, 'N');
  ASSERT_TRUE(map.spindle && map.spindle->commands && map.spindle->fault);
  EXPECT_EQ(map.spindle->commands->set_speed.address, 0x2001);
  EXPECT_EQ(map.spindle->commands->run_reverse.at(0).value, 0x22);
  EXPECT_EQ(map.spindle->speed.signal.at.address, 0x200B);
  EXPECT_EQ(map.spindle->fault->signal.at.address, 0x2008);
  EXPECT_FALSE(map.spindle->at_speed || map.spindle->direction);
}

TEST(RegisterMap, KeepsStepsOfACommandInOrder) {
  const SpindleCommands commands = *testing::shipped_map("siemens_v20").spindle->commands;
  ASSERT_EQ(commands.run_forward.size(), 2U);
  EXPECT_EQ(commands.run_forward[0].value, 0x047E);
  EXPECT_EQ(commands.run_forward[1].value, 0x047F);
}

TEST(RegisterMap, ReadsInterlocksAndFaultTexts) {
  const RegisterMap map = parse_register_map(plc_text(), "mine.toml");
  ASSERT_EQ(map.interlocks.size(), 4U);
  EXPECT_EQ(map.interlocks[3].name, "e-stop");
  EXPECT_EQ(map.interlocks[3].flag.signal.at.function, 2);
  EXPECT_EQ(map.interlocks[3].flag.signal.mask, 1);
  EXPECT_EQ(map.spindle->fault->texts.at(3), "collet open");
}

// Raw values by hand: 24000 rpm are 400 Hz, 4000 tenths (0x0FA0), 40000 hundredths, and all of
// P2000, which is 16384.
TEST(RegisterMap, ScalesSpeedsBothWays) {
  const auto raw = [](const std::string& name, double rpm) {
    const SpindleMap spindle = *testing::shipped_map(name).spindle;
    return raw_of_rpm(spindle.commands->scale, spindle.rpm_per_hz, rpm).value();
  };
  EXPECT_EQ(raw("yl620", 24000.0), 0x0FA0);
  EXPECT_EQ(raw("h100", 12000.0), 2000);
  EXPECT_EQ(raw("delta_ms300", 24000.0), 40000);
  EXPECT_EQ(raw("siemens_v20", 24000.0), 16384);
  EXPECT_EQ(raw("generic_plc", 23456.0), 23456);
  const SpindleMap v20 = *testing::shipped_map("siemens_v20").spindle;
  EXPECT_NEAR(rpm_of_raw(v20.speed.scale, v20.rpm_per_hz, 0xC000), 24000.0, 1e-9);
}

TEST(RegisterMap, RefusesRawValuesBeyondSixteenBits) {
  const SpeedScale scale{.in_hertz = true, .scale = 0.01};
  EXPECT_EQ(raw_of_rpm(scale, 60.0, 39321.0), 65535);
  EXPECT_FALSE(raw_of_rpm(scale, 60.0, 39322.0));
  EXPECT_FALSE(raw_of_rpm(scale, 60.0, -1.0));
}

struct BadEdit {
  std::string from;
  std::string to;
  std::string key;
  std::string says;
};

class BadRegisterMap : public ::testing::TestWithParam<BadEdit> {};

TEST_P(BadRegisterMap, IsRefusedWithFileKeyAndRule) {
  const BadEdit& edit = GetParam();
  EXPECT_THAT(refusal_of(with(plc_text(), edit.from, edit.to)),
              AllOf(HasSubstr("mine.toml: "), HasSubstr(edit.key + ": "), HasSubstr(edit.says)));
}

INSTANTIATE_TEST_SUITE_P(
    Edits, BadRegisterMap,
    ::testing::Values(
        BadEdit{"version = 1", "version = 2", "version", "2: this program reads version 1"},
        BadEdit{"lensforge.register-map", "x", "format", "must be one of: lensforge.register-map"},
        BadEdit{"name = \"PLC\"", "name = 7", "name", "7: must be a string"},
        BadEdit{"name = \"PLC\"", "name = \" \"", "name", "not blank"},
        BadEdit{"name = \"PLC\"", "name = \"a\\nb\"", "name", "one line"},
        BadEdit{"name = \"PLC\"", "nam = \"PLC\"", "name", "missing: a register map needs"},
        BadEdit{"name = \"PLC\"", "name = \"P\"\nspeed = 3", "speed", "unknown key"},
        BadEdit{"[transport]", "[transports]", "transport", "missing"},
        BadEdit{"kind = \"tcp\"", "kind = \"udp\"", "transport.kind", "must be one of: rtu, tcp"},
        BadEdit{"kind = \"tcp\"", "kind = \"rtu\"", "transport.device", "missing"},
        BadEdit{"port = 502", "port = 70000", "transport.port", "must be in 1 to 65535"},
        BadEdit{"port = 502", "port = 5.5", "transport.port", "must be a whole number"},
        BadEdit{"port = 502", "port = \"502\"", "transport.port", "must be a whole number"},
        BadEdit{"unit = 1 ", "unit = 256 ", "transport.unit", "must be in 0 to 255"},
        BadEdit{"connect_timeout", "baud = 9600\nconnect_timeout", "transport.baud", "unknown key"},
        BadEdit{"response_timeout = 0.3", "response_timeout = nan", "transport.response_timeout",
                "must be a finite number"},
        BadEdit{"response_timeout = 0.3", "response_timeout = 0", "transport.response_timeout",
                "must be in 0.005 to 30"},
        BadEdit{"reconnect_pause = 0.2", "reconnect_pause = 5", "transport.reconnect_pause_max",
                "must not be below"},
        BadEdit{"rpm_max = 24000", "rpm_max = 5000", "spindle.rpm_max", "not be below rpm_min"},
        BadEdit{"rpm_max = 24000", "rpm_max = 90000", "spindle.commands.set_speed.scale",
                "must fit into the register"},
        BadEdit{"stopped_rpm = 60", "stopped_rpm = 60\nrpm_min = 50", "line 49", "not TOML"},
        BadEdit{"rpm_min = 6000", "rpm_min = 60", "spindle.stopped_rpm", "must be below rpm_min"},
        BadEdit{"verify_reads = 3", "verify_reads = 1", "spindle.verify_reads", "in 2 to 100"},
        BadEdit{"function = 6 ", "function = 3 ", "spindle.commands.set_speed.function",
                "3: writing takes 5 or 15"},
        BadEdit{"function = 6 ", "function = 5 ", "spindle.commands.set_speed.function",
                "a speed is no bit"},
        BadEdit{"quantity = \"rpm\"", "quantity = \"krpm\"", "spindle.commands.set_speed.quantity",
                "must be one of: hz, rpm"},
        BadEdit{"function = 6\naddress = 1\nvalue = 1", "function = 5\naddress = 1\nvalue = 2",
                "spindle.commands.run_forward[0].value", "2: a coil takes 0 or 1"},
        BadEdit{"[[spindle.commands.stop]]", "[spindle.commands.stop]", "spindle.commands.stop",
                "a table: must be an array of at least one table"},
        BadEdit{"function = 4\naddress = 0", "function = 6\naddress = 0",
                "spindle.status.speed.function", "6: reading takes 1 (coil)"},
        BadEdit{"function = 4\naddress = 0", "function = 1\naddress = 0",
                "spindle.status.speed.function", "a speed is no bit"},
        BadEdit{"function = 4\naddress = 0", "function = 4\naddress = 65536",
                "spindle.status.speed.address", "must be in 0 to 65535"},
        BadEdit{"function = 4\naddress = 1", "function = 4\naddress = 1\nmask = 0",
                "spindle.status.fault.mask", "at least one bit set"},
        BadEdit{"function = 4\naddress = 1", "function = 4\naddress = 1\nmask = 0x10000",
                "spindle.status.fault.mask", "0x10000: must be in 0 to 65535"},
        BadEdit{"2 = \"spindle", "two = \"spindle", "spindle.status.fault.texts.two",
                "must be the code"},
        BadEdit{"address = 4\nexpected = 1", "address = 4\nexpected = 2",
                "spindle.status.at_speed.expected", "2: has bits outside the mask"},
        BadEdit{"reverse = 1", "reverse = 0", "spindle.status.direction.reverse",
                "must differ from forward"},
        BadEdit{"name = \"vacuum\"", "name = \"door\"", "interlocks[1].name",
                "is the name of an interlock above"},
        BadEdit{"name = \"vacuum\"", "", "interlocks[1].name", "missing"},
        BadEdit{"interval = 0.5", "interval = 0.001", "interlocks[2].interval", "in 0.01 to 60"},
        BadEdit{"interval = 0.5", "intervall = 0.5", "interlocks[2].interval", "missing"}));

TEST(RegisterMap, RefusesASpindleWithoutFaultRegisterUnlessTheMapSaysWhy) {
  std::string text = testing::read_bytes(find_register_map("h100"));
  EXPECT_NO_THROW((void)parse_register_map(text, "mine.toml"));
  text = with(text, "no_fault_register = \"no public source names one\"", "");
  EXPECT_THAT(refusal_of(text), AllOf(HasSubstr("mine.toml: spindle.status.fault: missing"),
                                      HasSubstr("no_fault_register")));
}

TEST(RegisterMap, RefusesAMapOfNothing) {
  std::string text = plc_text();
  text.resize(text.find("# A map has a spindle"));
  EXPECT_THAT(refusal_of(text), HasSubstr("needs a spindle, or interlocks, or both"));
}

TEST(RegisterMap, RefusesWhatIsNotToml) {
  EXPECT_THAT(refusal_of("a = = 1"), HasSubstr("mine.toml: line 1: not TOML"));
  EXPECT_THAT(refusal_of(std::string("name = \"a\0b\"", 12)), HasSubstr("not TOML"));
  EXPECT_THAT(refusal_of("a = " + std::string(100000, '[')), HasSubstr("brackets"));
}

// Every single line of the file is left out, and every key misspelt, one at a time: the reader
// takes the map or says why not, and a misspelt key is never taken.
TEST(RegisterMap, NoLineIsReadLaxly) {
  const std::string whole = plc_text();
  std::istringstream lines(whole);
  std::size_t at = 0;
  int keys = 0;
  for (std::string line; std::getline(lines, line); at += line.size() + 1) {
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('#') || equals == std::string::npos) continue;
    ++keys;
    const std::string without = whole.substr(0, at) + whole.substr(at + line.size() + 1);
    try {
      (void)parse_register_map(without, "mine.toml");
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("mine.toml: ")) << line;
    }
    if (!std::isdigit(static_cast<unsigned char>(line[0]))) {
      refusal_of(with(whole, line, with(line, " = ", "x = ")));
    }
  }
  EXPECT_GT(keys, 80);
}

TEST(RegisterMap, RefusesTheOldHuanyangProtocolByName) {
  for (const std::string name : {"huanyang", "Huanyang", "hy_vfd", "HY"}) {
    EXPECT_THAT(message_of<InputError>([&] { (void)find_register_map(name); }),
                AllOf(HasSubstr("'" + name + "'"), HasSubstr("do not speak Modbus")));
  }
  EXPECT_THAT(refusal_of(with(plc_text(), "protocol = \"modbus\"", "protocol = \"huanyang\"")),
              AllOf(HasSubstr("mine.toml: protocol: "), HasSubstr("do not speak Modbus")));
}

TEST(RegisterMap, NamesTheShippedMapsWhereOneIsUnknown) {
  EXPECT_THAT(message_of<InputError>([] { (void)find_register_map("vfd9"); }),
              AllOf(HasSubstr("'vfd9'"), HasSubstr("h100, siemens_v20, yl620")));
  EXPECT_EQ(find_register_map("./own/map"), "./own/map");
  EXPECT_EQ(find_register_map("own.toml"), "own.toml");
}

TEST(RegisterMap, RefusesFilesThatAreMissingOrTooLong) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { (void)read_register_map(folder / "no.toml"); }),
              HasSubstr("no.toml: cannot be read"));
  testing::write_bytes(folder / "long.toml", std::string((1U << 20U) + 1U, '#'));
  EXPECT_THAT(message_of<InputError>([&] { (void)read_register_map(folder / "long.toml"); }),
              HasSubstr("1048577 bytes: a register map has at most 1 MiB"));
}

TEST(RegisterMap, TakesAnotherEndpoint) {
  RegisterMap serial = testing::shipped_map("yl620");
  set_endpoint(serial, "/dev/ttyUSB7");
  EXPECT_EQ(serial.transport.device, "/dev/ttyUSB7");
  EXPECT_THAT(message_of<InputError>([&] { set_endpoint(serial, "10.0.0.7"); }),
              AllOf(HasSubstr("YL620"), HasSubstr("'10.0.0.7'"), HasSubstr("serial port")));
  RegisterMap network = testing::shipped_map("generic_plc");
  set_endpoint(network, "plc.local:1502");
  EXPECT_EQ(network.transport.host, "plc.local");
  EXPECT_EQ(network.transport.port, 1502);
  set_endpoint(network, "10.0.0.7");
  EXPECT_EQ(network.transport.host, "10.0.0.7");
  EXPECT_EQ(network.transport.port, 1502);
  for (const std::string bad : {"", ":502", "host:", "host:0", "host:65536", "host:5x", "/dev/x"}) {
    EXPECT_THROW(set_endpoint(network, bad), InputError) << bad;
  }
}

/// Run by the next test in a copy of this program.
TEST(RegisterMapFolder, DISABLED_Lists) {
  for (const std::string& name : shipped_register_maps()) std::printf("map:%s\n", name.c_str());
}

TEST(RegisterMapFolder, BesideAnInstalledProgramComesFirst) {
  namespace fs = std::filesystem;
  const TempFolder folder;
  const fs::path program = folder.path() / "prefix" / "bin" / "program";
  const fs::path maps = program.parent_path() / LENSFORGE_MAPS_FROM_PROGRAM;
  fs::create_directories(program.parent_path());
  fs::create_directories(maps);
  fs::copy_file(fs::read_symlink("/proc/self/exe"), program);
  testing::write_bytes(maps / "only_here.toml", plc_text());
  const std::string command = program.string() +
                              " --gtest_also_run_disabled_tests "
                              "--gtest_filter=RegisterMapFolder.DISABLED_Lists";
  FILE* pipe = ::popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  std::array<char, 256> line{};
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) output += line.data();
  EXPECT_EQ(::pclose(pipe), 0);
  EXPECT_THAT(output, HasSubstr("map:only_here\n"));
  EXPECT_THAT(output, ::testing::Not(HasSubstr("map:yl620")));
}

}  // namespace
}  // namespace lensforge
