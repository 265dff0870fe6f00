// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

std::string_view verdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::warn:
      return "warn";
    case Verdict::fail:
      return "fail";
  }
  return "?";
}

int exitStatus(const Findings& findings) {
  return std::ranges::count(findings, Verdict::fail, &Finding::verdict) > 0 ? 1 : 0;
}

std::string textOf(const Findings& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    text += fmt::format("{:<4}  {}: {}", verdictText(finding.verdict), finding.name, printable(finding.fact));
    if (!finding.remedy.empty()) text += fmt::format(" ({})", printable(finding.remedy));
    text += '\n';
  }
  return text;
}

std::string jsonOf(const Findings& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back({{"name", finding.name},
                    {"verdict", verdictText(finding.verdict)},
                    {"fact", finding.fact},
                    {"remedy", finding.remedy}});
  }
  return list.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace hapticd::tools
