// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/text/printer.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "config/base/counted.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

double numberIn(std::string_view text) {
  double number = 1;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

/// form: ".2" or ".2*1000".
std::string decimals(double value, std::string_view form) {
  const std::size_t times = form.find('*');
  const double factor = times == std::string_view::npos ? 1 : numberIn(form.substr(times + 1));
  return fixed(value * factor, form[1] - '0');
}

std::string latencies(const Json& reply, const std::string& path) {
  const auto at = [&](const char* name) { return duration(numberAt(reply, path + name)); };
  return fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", at(".p50Ns"), at(".p99Ns"), at(".p999Ns"),
                     at(".maxNs"));
}

std::string fieldText(const Json& reply, const std::string& path, std::string_view form) {
  if (form.empty()) return textAt(reply, path);
  if (form == "#") return countAt(reply, path);
  if (form == "latency") return latencies(reply, path);
  if (form == "ns") return duration(numberAt(reply, path));
  if (form == "age") return ageText(numberAt(reply, path));
  if (form == "mm") return millimetres(numberAt(reply, path));
  if (form == "bytes") return bytesText(numberAt(reply, path));
  switch (form.front()) {
    case '#':
      return base::counted(countAt(reply, path), form.substr(1));
    case '|':
      return decimals(lengthAt(reply, path), form.substr(1));
    case '(':
      return fmt::format("({}, {}, {})", decimals(numberAt(reply, path + ".x"), form.substr(1)),
                         decimals(numberAt(reply, path + ".y"), form.substr(1)),
                         decimals(numberAt(reply, path + ".z"), form.substr(1)));
    default:
      return decimals(numberAt(reply, path), form);
  }
}

/// place: what stands between braces.
std::string placeText(const Json& reply, std::string_view place) {
  if (const std::size_t mark = place.find('?'); mark != std::string_view::npos) {
    const std::size_t bar = place.find('|', mark);
    const bool flag = flagAt(reply, place.substr(0, mark));
    return std::string(flag ? place.substr(mark + 1, bar - mark - 1) : place.substr(bar + 1));
  }
  const std::size_t colon = std::min(place.find(':'), place.size());
  const std::string_view form = place.substr(std::min(colon + 1, place.size()));
  const std::size_t align = std::min(form.find_first_of("<>"), form.size());
  std::string text = fieldText(reply, std::string(place.substr(0, colon)), form.substr(0, align));
  if (align == form.size()) return text;
  const int width = static_cast<int>(numberIn(form.substr(align + 1)));
  return form[align] == '<' ? fmt::format("{:<{}}", text, width) : fmt::format("{:>{}}", text, width);
}

}  // namespace

std::string filled(const Json& reply, std::string_view pattern) {
  std::string text;
  while (true) {
    const std::size_t open = std::min(pattern.find('{'), pattern.size());
    text += pattern.substr(0, open);
    pattern.remove_prefix(open);
    if (pattern.empty()) return text;
    const std::size_t close = std::min(pattern.find('}'), pattern.size() - 1);
    text += placeText(reply, pattern.substr(1, close - 1));
    pattern.remove_prefix(close + 1);
  }
}

std::string statusRow(std::string_view title, const std::string& text) {
  return fmt::format("{:<14}{}", title, text);
}

std::string millimetres(double metres) {
  return std::isnan(metres) ? "-" : fmt::format("{:.1f} mm", metres * 1e3);
}

std::string bytesText(double bytes) {
  if (std::isnan(bytes)) return "-";
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes / 1e3);
  return bytes < 1e9 ? fmt::format("{:.1f} MB", bytes / 1e6) : fmt::format("{:.1f} GB", bytes / 1e9);
}

}  // namespace hapticd::tools
