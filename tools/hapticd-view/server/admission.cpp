// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/admission.h"

#include <algorithm>

namespace hapticd::tools::view {
namespace {

std::size_t countOf(std::span<const OpenConnection> open, const std::string& owner, bool unheard_only) {
  return static_cast<std::size_t>(std::ranges::count_if(open, [&](const OpenConnection& each) {
    return each.owner == owner && !(unheard_only && each.is_admitted);
  }));
}

/// The place of the oldest connection of an owner that has not been admitted.
std::optional<std::size_t> oldestUnheard(std::span<const OpenConnection> open, const std::string& owner) {
  const auto oldest = std::ranges::find_if(
      open, [&](const OpenConnection& each) { return each.owner == owner && !each.is_admitted; });
  if (oldest == open.end()) return std::nullopt;
  return static_cast<std::size_t>(oldest - open.begin());
}

}  // namespace

Admission admissionOf(std::span<const OpenConnection> open, const std::string& owner,
                      const ConnectionLimits& limits) {
  if (countOf(open, owner, false) >= limits.per_owner) {
    const auto own = oldestUnheard(open, owner);
    return {.is_served = own.has_value(), .gives_way = own};
  }
  if (open.size() < limits.all) return {};
  const auto greediest = std::ranges::max_element(
      open, {}, [&](const OpenConnection& each) { return countOf(open, each.owner, true); });
  const auto place = oldestUnheard(open, greediest->owner);
  return {.is_served = place.has_value(), .gives_way = place};
}

}  // namespace hapticd::tools::view
