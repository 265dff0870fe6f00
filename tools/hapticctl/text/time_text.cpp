// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/time_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>

namespace hapticd::tools {
namespace {

struct Unit {
  std::string_view name;
  double seconds;
};
constexpr std::array<Unit, 6> kUnits{
    {{"s", 1}, {"min", 60}, {"m", 60}, {"h", 3600}, {"d", 86400}, {"w", 7 * 86400}}};
constexpr double kNsPerSecond = 1e9;
/// Ages beyond that leave the range of a 64-bit time in nanoseconds.
constexpr double kMaxAge_s = 9e9;

std::tm utcOf(std::int64_t seconds) {
  return fmt::gmtime(static_cast<std::time_t>(seconds));
}

}  // namespace

std::string utcTime(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}Z", utcOf(static_cast<std::int64_t>(realtime_ns / kNsPerSecond)));
}

std::string utcTimeWithMilliseconds(double realtime_ns) {
  if (std::isnan(realtime_ns)) return "-";
  const auto milliseconds = static_cast<std::int64_t>(realtime_ns / 1e6);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03}Z", utcOf(milliseconds / 1000), milliseconds % 1000);
}

std::string ageText(double seconds) {
  if (std::isnan(seconds)) return "-";
  const double age_s = std::fmax(seconds, 0);
  if (age_s < 120) return fmt::format("{:.0f} s", std::floor(age_s));
  if (age_s < 2 * 3600) return fmt::format("{:.0f} min", std::floor(age_s / 60));
  if (age_s < 2 * 86400) return fmt::format("{:.0f} h", std::floor(age_s / 3600));
  return fmt::format("{:.0f} d", std::floor(age_s / 86400));
}

std::optional<double> secondsOfAge(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !(number >= 0)) return std::nullopt;
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const auto& [name, seconds] : kUnits) {
    if (unit == name && number * seconds <= kMaxAge_s) return number * seconds;
  }
  return std::nullopt;
}

std::optional<std::int64_t> timeFrom(std::string_view text, std::int64_t now_ns) {
  if (const auto age_s = secondsOfAge(text)) {
    return now_ns - static_cast<std::int64_t>(*age_s * kNsPerSecond);
  }
  const std::string time(text);
  for (const char* form :
       {"%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%d %H:%M:%SZ", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S",
        "%Y-%m-%dT%H:%M", "%Y-%m-%d %H:%M", "%Y-%m-%dT%H-%M-%SZ", "%Y-%m-%d"}) {
    std::tm utc{};
    const char* const end = ::strptime(time.c_str(), form, &utc);
    // before 1900 and after 2200 the nanoseconds would not fit into 64 bits
    if (end != nullptr && *end == '\0' && utc.tm_year >= 0 && utc.tm_year < 300) {
      return std::int64_t{::timegm(&utc)} * static_cast<std::int64_t>(kNsPerSecond);
    }
  }
  return std::nullopt;
}

std::int64_t realtimeNow_ns() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count();
}

}  // namespace hapticd::tools
