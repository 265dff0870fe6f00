// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/ros/ros_name.h"

#include <fmt/format.h>

#include "config/base/value_text.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kLongestNamespace = 200;

bool isLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace

std::string namespaceProblem(std::string& name) {
  if (name.starts_with('/')) name.erase(0, 1);
  bool begins = true;
  bool good = name.size() <= kLongestNamespace;
  for (const char c : name) {
    good = good && (begins ? isLetter(c) : isLetter(c) || isDigit(c) || c == '/');
    begins = c == '/';
  }
  if (good && !begins) return "";
  return fmt::format(
      "{} must be names of letters, digits and underscores, with / between them, at most {} in all",
      base::inQuotes(name), kLongestNamespace);
}

std::string ddsTopicName(const std::string& topic) {
  return topic == kDiscoveryTopic ? topic : "rt/" + topic;
}

}  // namespace hapticd::tools::ros
