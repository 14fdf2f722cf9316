// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Bytes on which a Grbl-family controller acts at once, wherever in the stream they stand.
namespace realtime {
inline constexpr char kStatusReport = '?';
inline constexpr char kFeedHold = '!';
inline constexpr char kCycleStart = '~';
inline constexpr char kSoftReset = '\x18';
inline constexpr char kFeedTo100 = '\x90';
inline constexpr char kFeedUp10 = '\x91';
inline constexpr char kFeedDown10 = '\x92';
inline constexpr char kRapidTo100 = '\x95';
inline constexpr char kRapidTo50 = '\x96';
inline constexpr char kRapidTo25 = '\x97';
inline constexpr char kSpindleTo100 = '\x99';
inline constexpr char kSpindleUp10 = '\x9A';
inline constexpr char kSpindleDown10 = '\x9B';
}  // namespace realtime

}  // namespace lensforge
