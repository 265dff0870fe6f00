// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/columns.h"

#include <array>
#include <utility>

#include "rt/law_table.h"

namespace hapticd::tools {

std::string_view unitOf(std::string_view field) {
  // the longer endings first
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kUnits{{{"_m_per_s", "m/s"},
                                                                                 {"_n_per_m", "N/m"},
                                                                                 {"_ns", "ns"},
                                                                                 {"_s", "s"},
                                                                                 {"_n", "N"},
                                                                                 {"_m", "m"},
                                                                                 {"_j", "J"}}};
  constexpr std::string_view kFrame = "_in_world";
  if (field.ends_with(kFrame)) field.remove_suffix(kFrame.size());
  for (const auto& [ending, unit] : kUnits) {
    if (field.ends_with(ending)) return unit;
  }
  return "";
}

bool needsProxy(std::string_view field) {
  return field == "contact" || field == "proxy_m_in_world";
}

bool applies(const rt::Tick& tick, std::string_view field) {
  return rt::hasProxy(tick.law) || !needsProxy(field);
}

std::string joined(const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string text;
  for (const auto& [name, value] : pairs) text += (text.empty() ? "" : "; ") + name + "=" + value;
  return text;
}

std::string inCsvQuotes(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace hapticd::tools
