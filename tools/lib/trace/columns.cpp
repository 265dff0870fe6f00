// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/trace/columns.h"

#include "rt/law_table.h"

namespace hapticd::tools {

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
