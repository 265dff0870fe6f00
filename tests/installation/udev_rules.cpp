// SPDX-License-Identifier: Apache-2.0
#include "tests/installation/udev_rules.h"

#include <fnmatch.h>

#include <regex>
#include <set>
#include <sstream>

namespace hapticd::test {
namespace {

bool isMatch(const UdevToken& token) {
  return token.operation == "==" || token.operation == "!=";
}

bool isKnown(const UdevToken& token) {
  static const std::set<std::string> kMatches{
      "ACTION",          "SUBSYSTEM",         "KERNEL",           "KERNELS", "ENV{DEVTYPE}", "ATTR{idVendor}",
      "ATTR{idProduct}", "ENV{ID_VENDOR_ID}", "ENV{ID_MODEL_ID}", "PROGRAM", "TEST"};
  static const std::set<std::string> kAssignments{"GROUP", "MODE", "GOTO", "LABEL", "ATTR{power/control}"};
  static const std::set<std::string> kAdditions{"RUN"};
  if (token.operation == "+=") return kAdditions.contains(token.key);
  return (isMatch(token) ? kMatches : kAssignments).contains(token.key);
}

std::vector<UdevToken> tokensOf(const std::string& line, std::vector<std::string>& mistakes) {
  static const std::regex kToken(R"re(^\s*([A-Z]+(\{[^}]+\})?)(==|!=|\+=|=)"([^"]*)"\s*(,|$))re");
  std::vector<UdevToken> tokens;
  std::string rest = line;
  for (std::smatch match; !rest.empty(); rest = match.suffix().str()) {
    if (!std::regex_search(rest, match, kToken)) {
      mistakes.push_back(line);
      break;
    }
    tokens.push_back({match[1], match[3], match[4]});
    if (!isKnown(tokens.back())) mistakes.push_back(line);
  }
  return tokens;
}

void findLostJumps(UdevRules& rules) {
  std::set<std::string> labels;
  for (auto rule = rules.rules.rbegin(); rule != rules.rules.rend(); ++rule) {
    for (const UdevToken& token : *rule) {
      if (token.key == "LABEL") labels.insert(token.value);
      if (token.key == "GOTO" && !labels.contains(token.value))
        rules.mistakes.push_back("GOTO " + token.value);
    }
  }
}

bool matchesOne(const std::string& value, const std::string& patterns) {
  std::istringstream alternatives(patterns);
  for (std::string pattern; std::getline(alternatives, pattern, '|');) {
    if (::fnmatch(pattern.c_str(), value.c_str(), 0) == 0) return true;
  }
  return false;
}

bool applies(const std::vector<UdevToken>& rule, const UdevDevice& device) {
  for (const UdevToken& token : rule) {
    if (!isMatch(token)) continue;
    const auto value = device.find(token.key);
    const bool same = value != device.end() && matchesOne(value->second, token.value);
    if (same != (token.operation == "==")) return false;
  }
  return true;
}

}  // namespace

UdevRules parseUdevRules(const std::string& text) {
  UdevRules rules;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    rules.rules.push_back(tokensOf(line, rules.mistakes));
  }
  findLostJumps(rules);
  return rules;
}

UdevResult applyUdevRules(const UdevRules& rules, const UdevDevice& device) {
  UdevResult result;
  std::string skip_to;
  for (const std::vector<UdevToken>& rule : rules.rules) {
    if (!skip_to.empty() && (rule.front().key != "LABEL" || rule.front().value != skip_to)) continue;
    skip_to.clear();
    if (!applies(rule, device)) continue;
    for (const UdevToken& token : rule) {
      if (isMatch(token) || token.key == "LABEL") continue;
      if (token.key == "GOTO") skip_to = token.value;
      if (token.key != "GOTO") result[token.key] = token.value;
    }
  }
  return result;
}

}  // namespace hapticd::test
