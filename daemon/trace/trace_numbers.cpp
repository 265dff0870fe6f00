// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/trace_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

#include "config/yaml/yaml_reader.h"
#include "daemon/state/state_file.h"
#include "drivers/trace/trace_folder.h"

namespace hapticd::daemon {
namespace {

constexpr const char* kFile = "trace_count.yaml";

template <typename Number>
bool take(const config::YamlFile& content, std::string_view name, Number& number) {
  const auto entry = std::ranges::find_if(content.entries, [name](const config::YamlEntry& one) {
    return one.group == "traces" && one.name == name;
  });
  if (entry == content.entries.end()) return false;
  const std::string& text = entry->value;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::optional<TraceNumbers::Count> TraceNumbers::fromFile() const {
  const auto text = readStateFile(folder_ / kFile);
  if (!text || !*text) return std::nullopt;
  const config::YamlFile content = config::readYaml(**text);
  Count count;
  const bool whole = take(content, "number", count.number) && take(content, "latest_ns", count.latest_ns);
  return whole ? std::optional(count) : std::nullopt;
}

TraceNumbers::Count TraceNumbers::fromTraces() const {
  Count count;
  const auto traces = drivers::listTraces(folder_ / "traces");
  if (!traces) return count;  // where it cannot be read, no trace begins either
  for (const drivers::TraceEntry& trace : *traces) {
    count.number = std::max(count.number, trace.number);
    if (trace.clock_is_set.value_or(true)) count.latest_ns = std::max(count.latest_ns, trace.begin_ns);
  }
  return count;
}

TraceNumbers::Next TraceNumbers::next(const drivers::WallClock& clock) {
  if (!last_) last_ = fromFile();
  if (!last_) {
    last_ = fromTraces();
    traces_counted_ = true;
  }
  const bool is_set = clock.isSet(last_->latest_ns);
  Count count{last_->number + 1, is_set ? clock.realtime_ns : last_->latest_ns};
  const std::string text =
      fmt::format("traces: {{number: {}, latest_ns: {}}}\n", count.number, count.latest_ns);
  const bool kept = replaceFile(folder_ / kFile, text).has_value();
  if (!kept && !std::exchange(traces_counted_, true)) {
    count.number = std::max(count.number, fromTraces().number + 1);  // the file may have been kept for long
  }
  last_ = count;
  return {count.number, is_set};
}

}  // namespace hapticd::daemon
