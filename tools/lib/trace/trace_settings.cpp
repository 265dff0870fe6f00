// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/trace_settings.h"

#include <charconv>
#include <cmath>
#include <system_error>

#include "config/yaml/yaml_reader.h"
#include "rt/base/clock.h"

namespace hapticd::tools {

std::string_view settingsText(const drivers::TraceInfo& trace) {
  for (const drivers::TraceAttachment& attachment : trace.attachments) {
    if (attachment.name == "settings.yaml") return attachment.data;
  }
  return {};
}

std::vector<TraceSetting> settingsIn(std::string_view text) {
  std::vector<TraceSetting> settings;
  for (config::YamlEntry& entry : config::readYaml(text).entries) {
    settings.push_back({entry.group + "." + entry.name, std::move(entry.value), entry.quoted});
  }
  return settings;
}

std::optional<double> numberIn(std::string_view value) {
  if (value == "true") return 1;
  if (value == "false") return 0;
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

std::optional<std::int64_t> periodIn(const drivers::TraceInfo& trace) {
  for (const TraceSetting& setting : settingsIn(settingsText(trace))) {
    if (setting.name != "loop.rate_hz") continue;
    const std::optional<double> rate_hz = numberIn(setting.value);
    if (rate_hz && *rate_hz >= 1 && *rate_hz <= 1e6) {
      return std::llround(static_cast<double>(rt::kNsPerSecond) / *rate_hz);
    }
  }
  return std::nullopt;
}

}  // namespace hapticd::tools
