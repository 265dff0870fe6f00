// SPDX-License-Identifier: Apache-2.0
#include "config/base/nearest_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace hapticd::base {
namespace {

constexpr std::size_t kMaxSuggestions = 3;
constexpr std::size_t kMaxNameLength = 64;  // longer ones are not near anything; bounds the work

// Returns the number of characters to insert, delete or replace to turn one into the other (Levenshtein).
std::size_t editDistance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string_view lastPart(std::string_view name) {
  return name.substr(name.rfind('.') + 1);
}

bool isPartOf(std::string_view part, std::string_view whole) {
  return part.size() >= 4 && whole.find(part) != std::string_view::npos;
}

// 0: the same name; a correct last part in the wrong group counts as one wrong character.
std::size_t distance(std::string_view name, std::string_view candidate) {
  if (isPartOf(lastPart(name), lastPart(candidate))) return 1;
  return std::min(editDistance(name, candidate), editDistance(lastPart(name), lastPart(candidate)) + 1);
}

}  // namespace

std::string didYouMean(std::string_view name, std::span<const std::string_view> candidates) {
  if (name.size() > kMaxNameLength) return {};
  const std::size_t farthest = std::max<std::size_t>(1, lastPart(name).size() / 3);
  std::vector<std::pair<std::size_t, std::string_view>> near;
  for (const std::string_view candidate : candidates) {
    const std::size_t steps = distance(name, candidate);
    if (steps <= farthest) near.emplace_back(steps, candidate);
  }
  if (near.empty()) return {};
  std::ranges::stable_sort(near, {}, &std::pair<std::size_t, std::string_view>::first);
  near.resize(std::min(near.size(), kMaxSuggestions));
  std::vector<std::string_view> names;
  for (const auto& [steps, candidate] : near) names.push_back(candidate);
  return fmt::format("did you mean {}?", fmt::join(names, " or "));
}

}  // namespace hapticd::base
