// SPDX-License-Identifier: Apache-2.0
#include "daemon/state/settings_reader.h"

#include <fmt/format.h>

namespace hapticd::daemon {

void SettingsReader::begin(Clock::time_point now) {
  deadline_ = now + kPatience;
  reading_ = worker_.run(read_);
}

std::optional<SettingsReader::Outcome> SettingsReader::outcome(Clock::time_point now) {
  if (!reading_.valid()) return std::nullopt;
  if (reading_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return reading_.get();
  if (now < deadline_) return std::nullopt;
  reading_ = {};
  return std::unexpected(std::vector{base::Error{
      name_, fmt::format("has not been read after {} s: the disk does not answer", kPatience.count()),
      "check the disk or the network file system, and reload again"}});
}

}  // namespace hapticd::daemon
