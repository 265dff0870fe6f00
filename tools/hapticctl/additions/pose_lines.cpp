// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/pose_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "config/base/value_text.h"

namespace hapticd::tools {
namespace {

constexpr std::string_view kBlanks = " \t\r,;";
constexpr std::array<std::string_view, 5> kMembers{"positionM", "orientationXyzw", "timeNs", "ageS",
                                                   "velocityMPerS"};

std::expected<Json, std::string> fromJson(const std::string& line) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object()) return std::unexpected("is not a JSON object");
  for (auto member = json.begin(); member != json.end(); ++member) {
    if (std::ranges::find(kMembers, member.key()) == kMembers.end())
      return std::unexpected(
          fmt::format("has the member {}, which FeedPose does not have", base::inQuotes(member.key())));
  }
  return json;
}

}  // namespace

std::expected<Json, std::string> poseFromLine(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(kBlanks);
  if (begin == std::string::npos || line[begin] == '#') return Json();
  if (line[begin] == '{') return fromJson(line);
  std::vector<double> numbers;
  for (std::size_t at = begin; at != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    const std::string word = line.substr(at, end - at);
    const auto number = base::numberFrom<double>(word);
    if (!number || !std::isfinite(*number))
      return std::unexpected(fmt::format("{} is not a finite number", base::inQuotes(word)));
    numbers.push_back(*number);
    at = line.find_first_not_of(kBlanks, end);
  }
  if (numbers.size() != 7 && numbers.size() != 8)
    return std::unexpected(
        fmt::format("has {} numbers; write x,y,z,qx,qy,qz,qw or these and an age", numbers.size()));
  Json pose{{"positionM", {numbers[0], numbers[1], numbers[2]}},
            {"orientationXyzw", {numbers[3], numbers[4], numbers[5], numbers[6]}}};
  if (numbers.size() == 8) pose["ageS"] = numbers[7];
  return pose;
}

}  // namespace hapticd::tools
