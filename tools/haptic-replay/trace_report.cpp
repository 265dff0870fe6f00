// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-replay/trace_report.h"

#include <array>
#include <iterator>
#include <numeric>
#include <set>

namespace hapticd::tools {
namespace {

/// "3..5, 9, ...": at most so many stretches.
std::string stretchesOf(const std::set<std::uint64_t>& numbers) {
  constexpr int kMaxStretches = 20;
  std::string text;
  int stretches = 0;
  for (auto number = numbers.begin(); number != numbers.end();) {
    if (++stretches > kMaxStretches) return text + ", ...";
    const std::uint64_t first = *number;
    std::uint64_t last = first;
    while (++number != numbers.end() && *number == last + 1) ++last;
    text += text.empty() ? "" : ", ";
    text += first == last ? fmt::format("{}", first) : fmt::format("{}..{}", first, last);
  }
  return text;
}

std::string leftOutText(const TraceComparison& comparison) {
  constexpr std::array<const char*, kLeftOutReasons> kReasons{
      "before the first recorded depth frame",
      "their depth frame is not recorded",
      "filter or fusion remember what is not recorded",
      "their scene is not in the trace",
      "their parameters are not in the trace",
      "their fixtures or tissue regions are not in the trace",
      "before the first snapshot of the core, or the next one after a gap"};
  std::string text;
  for (std::size_t reason = 0; reason < kLeftOutReasons; ++reason) {
    if (comparison.left_out[reason] == 0) continue;
    text += fmt::format("left out {} ticks: {}\n", comparison.left_out[reason], kReasons[reason]);
  }
  if (!comparison.missing_frames.empty()) {
    text += fmt::format("depth frames that are not recorded: {} ({})\n", comparison.missing_frames.size(),
                        stretchesOf(comparison.missing_frames));
  }
  return text;
}

std::string unknownText(const std::set<std::string>& parameters) {
  if (parameters.empty()) return "";
  return fmt::format("left out parameters that this version does not have: {}\n",
                     fmt::join(parameters, ", "));
}

}  // namespace

void ForceTable::add(const rt::Tick& recorded, const rt::Tick& computed) {
  const rt::Vec3& was = recorded.command_force_n_in_world;
  const rt::Vec3& is = computed.command_force_n_in_world;
  fmt::format_to(std::back_inserter(text_), "{},{:.9f},{},{},{},{},{},{},{}\n", recorded.number,
                 static_cast<double>(recorded.planned_ns) * 1e-9, was.x, was.y, was.z, is.x, is.y, is.z,
                 rt::norm(is - was));
}

std::string ForceTable::text() const {
  return "tick,t_s,recorded_fx_n,recorded_fy_n,recorded_fz_n,fx_n,fy_n,fz_n,difference_n\n" +
         fmt::to_string(text_);
}

std::uint64_t leftOut(const TraceComparison& comparison) {
  return std::accumulate(comparison.left_out.begin(), comparison.left_out.end(), std::uint64_t{0});
}

std::string comparisonText(const TraceComparison& comparison) {
  const std::string where =
      comparison.worst_tick == 0 ? "" : fmt::format(" at tick {}", comparison.worst_tick);
  return fmt::format(
      "{} ticks computed again ({} in contact, {} scenes modelled), {} left out\n"
      "{}{}different: {} ticks\n"
      "largest difference: {:g} N of the commanded force{}, {:g} N of the law's\n",
      comparison.ticks, comparison.in_contact, comparison.models, leftOut(comparison),
      leftOutText(comparison), unknownText(comparison.unknown_parameters), comparison.different,
      comparison.largest_difference_n, where, comparison.largest_law_difference_n);
}

}  // namespace hapticd::tools
