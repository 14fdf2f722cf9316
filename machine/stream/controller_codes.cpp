// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/controller_codes.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

// Numbers as documented for Grbl 1.1 (1 to 38, alarms 1 to 9) and grblHAL (the rest, which gives 5,
// 9, 18 and 19 much the same meaning).
namespace lensforge {
namespace {

struct Code {
  int number;
  std::string_view meaning;
};

constexpr std::array kErrors = std::to_array<Code>({
    {1, "a word does not begin with a letter"},
    {2, "a number is missing or malformed"},
    {3, "unknown $ command"},
    {4, "a value must not be negative"},
    {5, "homing is switched off ($22)"},
    {6, "the step pulse is too short ($0)"},
    {7, "the stored settings could not be read and were reset"},
    {8, "this command is only taken while the machine is idle"},
    {9, "locked: alarm or jogging; home the machine ($H) or unlock it ($X)"},
    {10, "soft limits need homing to be switched on"},
    {11, "the line is too long"},
    {12, "the setting asks for more steps per second than possible"},
    {13, "the safety door is open"},
    {14, "the stored line is too long"},
    {15, "the jog would leave the machine's travel"},
    {16, "malformed jog command"},
    {17, "laser mode needs a spindle output with PWM"},
    {18, "a reset was asserted"},
    {19, "a value must be above zero"},
    {20, "unsupported or invalid G-code"},
    {21, "two words of one modal group in a line"},
    {22, "no feed has been set"},
    {23, "a word needs an integer"},
    {24, "two words that both use the axis words"},
    {25, "a word is given twice in a line"},
    {26, "axis words are missing"},
    {27, "line number out of range"},
    {28, "a P or L word is missing"},
    {29, "this work coordinate system is not supported"},
    {30, "G53 needs G0 or G1"},
    {31, "axis words that nothing uses"},
    {32, "an arc without axis words in its plane"},
    {33, "the target of the motion is invalid"},
    {34, "the radius of an arc is invalid"},
    {35, "an arc without offsets in its plane"},
    {36, "words that nothing uses"},
    {37, "a tool length offset on another axis than the tool's"},
    {38, "tool number too large"},
    {39, "a value is out of range"},
    {40, "a tool change is pending"},
    {41, "the spindle does not turn"},
    {42, "this plane is not allowed here"},
    {43, "feed above the machine's maximum"},
    {44, "spindle speed out of range"},
    {45, "a limit switch is engaged"},
    {46, "the machine must be homed first"},
    {47, "tool error"},
    {48, "conflicting words"},
    {49, "the self-test failed"},
    {50, "the emergency stop is active"},
    {51, "a motor driver reports a fault"},
    {52, "setting out of range"},
    {53, "the setting is not available"},
    {54, "invalid retract position"},
    {55, "homing is set up wrongly"},
    {56, "the coordinate system is locked"},
    {57, "file demarcation in an unexpected place"},
    {58, "the auxiliary port is not available"},
    {60, "the SD card cannot be mounted"},
    {61, "the file cannot be read"},
    {62, "the folder cannot be opened"},
    {63, "no such folder"},
    {64, "no SD card is mounted"},
    {65, "no file system is mounted"},
    {66, "the file system is read-only"},
    {70, "Bluetooth could not be started"},
    {71, "unknown operation in an expression"},
    {77, "a password is required"},
    {78, "access denied"},
    {79, "not allowed while a critical event is active"},
    {81, "malformed flow control"},
});

constexpr std::array kAlarms = std::to_array<Code>({
    {1, "a limit switch was hit; the position is lost, home the machine"},
    {2, "the target is outside the machine's travel; the position is still known"},
    {3, "reset while in motion; the position is lost, home the machine"},
    {4, "the probe was not in its initial state"},
    {5, "the probe found nothing"},
    {6, "homing was reset"},
    {7, "the safety door was opened during homing"},
    {8, "homing could not leave the limit switch"},
    {9, "homing did not find the limit switch"},
    {10, "the emergency stop is active"},
    {11, "the machine must be homed"},
    {12, "a limit switch is engaged"},
    {13, "the probe protection was triggered"},
    {14, "the spindle did not reach its speed or failed"},
    {15, "homing did not find the second switch of a ganged axis"},
    {16, "the self-test failed"},
    {17, "a motor driver reports a fault"},
    {18, "homing failed"},
});

std::string explained(const std::string& name, int number, std::span<const Code> codes) {
  const auto found = std::find_if(codes.begin(), codes.end(),
                                  [&](const Code& code) { return code.number == number; });
  const std::string meaning =
      found == codes.end() ? "a number that is not documented" : std::string(found->meaning);
  return name + ":" + std::to_string(number) + ": " + meaning;
}

}  // namespace

std::string explain_error(int code) { return explained("error", code, kErrors); }

std::string explain_alarm(int code) { return explained("ALARM", code, kAlarms); }

}  // namespace lensforge
