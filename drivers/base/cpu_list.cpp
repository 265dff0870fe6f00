// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/cpu_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>

namespace hapticd::drivers {
namespace {

constexpr int kLastCpu = 65535;

std::optional<int> cpuOf(std::string_view text) {
  int cpu = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cpu);
  const bool reads = error == std::errc() && end == text.data() + text.size();
  return reads && cpu >= 0 && cpu <= kLastCpu ? std::optional(cpu) : std::nullopt;
}

}  // namespace

std::optional<CpuSet> parseCpuList(std::string_view text) {
  CpuSet cpus;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view range = text.substr(0, comma);
    const std::size_t dash = range.find('-');
    const auto first = cpuOf(range.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : cpuOf(range.substr(dash + 1));
    if (!first || !last || *first > *last) return std::nullopt;
    for (int cpu = *first; cpu <= *last; ++cpu) cpus.insert(cpu);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return cpus;
}

std::string cpuListText(const CpuSet& cpus) {
  std::string text;
  for (auto first = cpus.begin(); first != cpus.end();) {
    auto last = first;
    while (std::next(last) != cpus.end() && *std::next(last) == *last + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", *first);
    if (last != first) text += fmt::format("-{}", *last);
    first = std::next(last);
  }
  return text;
}

CpuSet common(const CpuSet& a, const CpuSet& b) {
  CpuSet both;
  std::ranges::set_intersection(a, b, std::inserter(both, both.end()));
  return both;
}

}  // namespace hapticd::drivers
