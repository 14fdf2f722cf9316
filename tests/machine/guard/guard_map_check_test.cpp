// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/error.h"
#include "core/temp_folder.h"
#include "machine/guard/register_map.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;

/// What differs from a map that is all right, by the name of its place.
using Edits = std::map<std::string, std::string>;

std::string map_with(const Edits& edits) {
  const auto value = [&](const std::string& place, const std::string& usual) {
    const auto found = edits.find(place);
    return found == edits.end() ? usual : found->second;
  };
  const std::string read = "interval = 0.1\nretries = 3\n";
  return "format = \"lensforge.register-map\"\nversion = 1\nprotocol = \"modbus\"\nname = \"M\"\n"
         "[transport]\nkind = \"tcp\"\nhost = \"127.0.0.1\"\nport = 502\nunit = 1\n"
         "connect_timeout = 1.0\nresponse_timeout = 0.3\nbyte_timeout = 0.0\nrequest_gap = 0.0\n"
         "reconnect_pause = 0.2\nreconnect_pause_max = 3.0\nsilence_limit = 2.0\n"
         "[spindle]\nrpm_min = " +
         value("rpm_min", "6000") +
         "\nrpm_max = 24000\nrpm_per_hz = 60\ntolerance = " + value("tolerance", "0.05") +
         "\nverify_reads = 3\nlost_reads = 2\nstopped_rpm = " + value("stopped", "60") +
         "\nspin_up_limit = 15.0\nspin_down_limit = 30.0\n[spindle.commands]\nretries = 3\n"
         "set_speed = { function = 6, address = 0, quantity = \"rpm\", " +
         value("told", "scale = 1.0") + " }\nrun_forward = [" +
         value("forward", "{ function = 6, address = 1, value = 1 }") + "]\nrun_reverse = [" +
         value("reverse", "{ function = 6, address = 1, value = 2 }") + "]\nstop = [" +
         value("stop", "{ function = 6, address = 1, value = 0 }") + "]\n[spindle.status.speed]\n" +
         value("speed", "function = 4\naddress = 0") + "\nquantity = \"rpm\"\n" +
         value("read", "scale = 1.0") + "\n" + read + "[spindle.status.fault]\n" +
         value("fault", "function = 4\naddress = 1") + "\nclear = 0\n" + read + value("texts", "") +
         "\n[spindle.status.at_speed]\n" + value("at_speed", "function = 2\naddress = 4") +
         "\nexpected = 1\n" + read + "[[interlocks]]\nname = \"door\"\n" +
         value("door", "function = 2\naddress = 0") + "\nexpected = 1\n" + read;
}

std::string refusal_of(const Edits& edits) {
  return message_of<InputError>([&] { (void)parse_register_map(map_with(edits), "mine.toml"); });
}

struct Contradiction {
  const char* name;
  Edits edits;
  const char* key;
  const char* says;
};

class ContradictoryMap : public ::testing::TestWithParam<Contradiction> {};

TEST_P(ContradictoryMap, IsRefusedWhenItIsRead) {
  const std::string message = refusal_of(GetParam().edits);
  EXPECT_THAT(message, HasSubstr(std::string("mine.toml: ") + GetParam().key + ": "));
  EXPECT_THAT(message, HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Maps, ContradictoryMap,
    ::testing::Values(Contradiction{"RunIsStop",
                                    {{"forward", "{ function = 6, address = 1, value = 0 }"}},
                                    "spindle.commands.run_forward",
                                    "leaves the registers as stop does"},
                      Contradiction{"RunByAnotherFunctionIsStop",
                                    {{"forward", "{ function = 16, address = 1, value = 0 }"}},
                                    "spindle.commands.run_forward",
                                    "leaves the registers as stop does"},
                      Contradiction{"RunEndsAsStop",
                                    {{"forward",
                                      "{ function = 6, address = 1, value = 1 }, "
                                      "{ function = 6, address = 1, value = 0 }"}},
                                    "spindle.commands.run_forward",
                                    "leaves the registers as stop does"},
                      Contradiction{"StopStartsAgain",
                                    {{"stop",
                                      "{ function = 6, address = 1, value = 0 }, "
                                      "{ function = 6, address = 2, value = 0 }, "
                                      "{ function = 6, address = 1, value = 1 }"}},
                                    "spindle.commands.run_forward",
                                    "leaves the registers as stop does"},
                      Contradiction{"ReverseIsStop",
                                    {{"reverse", "{ function = 6, address = 1, value = 0 }"}},
                                    "spindle.commands.run_reverse",
                                    "leaves the registers as stop does"},
                      Contradiction{"ReverseIsForward",
                                    {{"reverse", "{ function = 6, address = 1, value = 1 }"}},
                                    "spindle.commands.run_reverse",
                                    "leaves the registers as run_forward does"},
                      Contradiction{"RunWritesTheSpeed",
                                    {{"forward",
                                      "{ function = 6, address = 1, value = 1 }, "
                                      "{ function = 16, address = 0, value = 30000 }"}},
                                    "spindle.commands.run_forward",
                                    "register of set_speed"},
                      Contradiction{"StopWritesASpeed",
                                    {{"stop", "{ function = 6, address = 0, value = 9000 }"}},
                                    "spindle.commands.stop",
                                    "register of set_speed"},
                      Contradiction{"SpeedIsReadBack",
                                    {{"speed", "function = 3\naddress = 0"}},
                                    "spindle.status.speed",
                                    "holds the requested value"},
                      Contradiction{"AtSpeedIsReadBack",
                                    {{"at_speed", "function = 3\naddress = 1"}},
                                    "spindle.status.at_speed",
                                    "holds the requested value"},
                      Contradiction{"InterlockIsReadBack",
                                    {{"door", "function = 3\naddress = 1"}},
                                    "door",
                                    "holds the requested value"},
                      Contradiction{"FaultIsSpeed",
                                    {{"fault", "function = 4\naddress = 0"}},
                                    "spindle.status.fault",
                                    "is read as spindle.status.speed too"},
                      Contradiction{"InterlockIsAtSpeed",
                                    {{"door", "function = 2\naddress = 4"}},
                                    "door",
                                    "is read as spindle.status.at_speed too"},
                      Contradiction{"ToldTooCoarsely",
                                    {{"told", "scale = 10000.0"}},
                                    "spindle.commands.set_speed",
                                    "a finer scale is needed"},
                      Contradiction{"ReadTooCoarsely",
                                    {{"read", "scale = 10000.0"}},
                                    "spindle.status.speed",
                                    "a finer scale is needed"},
                      Contradiction{"ReadBeyondTheRegister",
                                    {{"read", "scale = 0.1"}},
                                    "spindle.status.speed",
                                    "must fit into the register"},
                      Contradiction{"NeverReadsAStandstill",
                                    {{"read", "scale = 1.0\noffset = 500.0"}},
                                    "spindle.status.speed",
                                    "no reading means standing still"},
                      Contradiction{"StandstillIsASpeed",
                                    {{"rpm_min", "100"}, {"tolerance", "0.5"}},
                                    "spindle.stopped_rpm",
                                    "must be below what passes for rpm_min, 50"},
                      Contradiction{"NoFaultHasAName",
                                    {{"texts", "texts = { 0 = \"too hot\" }"}},
                                    "spindle.status.fault.texts",
                                    "must have no text"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(RegisterMapCheck, TakesWhatDiffersWhereItHasTo) {
  for (const Edits& edits : std::vector<Edits>{
           {},
           {{"stop", "{ function = 6, address = 0, value = 0 }"}},
           {{"stop", "{ function = 5, address = 1, value = 1 }"}},
           {{"forward",
             "{ function = 6, address = 3, value = 1 }, { function = 6, address = 1, value = 1 }"},
            {"reverse",
             "{ function = 6, address = 3, value = 2 }, { function = 6, address = 1, value = 1 }"}},
           {{"fault", "function = 2\naddress = 7"}, {"at_speed", "function = 2\naddress = 8"}}}) {
    EXPECT_NO_THROW((void)parse_register_map(map_with(edits), "mine.toml"));
  }
  for (const std::string& name : shipped_register_maps()) {
    EXPECT_NO_THROW((void)read_register_map(find_register_map(name))) << name;
  }
}

}  // namespace
}  // namespace lensforge
