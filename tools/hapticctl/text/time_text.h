// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hapticd::tools {

// hapticctl shows all times in UTC, as the names of traces do: a trace, its list entry and its events then
// carry the same time on every computer that they are copied to.

/// "2026-03-04 05:06:07Z"; "-" for NaN. realtime_ns: CLOCK_REALTIME.
std::string utcTime(double realtime_ns);

/// "2026-03-04 05:06:07.123Z"; "-" for NaN. realtime_ns: CLOCK_REALTIME.
std::string utcTimeWithMilliseconds(double realtime_ns);

/// "45 s", "12 min", "5 h", "30 d": how long something lasts or ago it was, in the largest unit that it fills
/// twice; "-" for NaN. A time in the future is 0 s ago.
std::string ageText(double seconds);

/// The seconds that "90s", "45min", "12h", "30d" or "2w" stands for; nothing where the text is no age.
std::optional<double> secondsOfAge(std::string_view text);

/// CLOCK_REALTIME, in nanoseconds, of a date and time in UTC ("2026-03-04", "2026-03-04 05:06",
/// "2026-03-04T05:06:07Z") or of an age before now_ns ("12h"); nothing where the text is neither.
std::optional<std::int64_t> timeFrom(std::string_view text, std::int64_t now_ns);

/// CLOCK_REALTIME now.
std::int64_t realtimeNow_ns();

}  // namespace hapticd::tools
