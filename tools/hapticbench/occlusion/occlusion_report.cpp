// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/occlusion/occlusion_bounds.h"

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kExplanation =
    "passages: a body of that thickness and 80 mm width passes at 0.3 m/s that gap before the HIP's line to "
    "the "
    "wall.\n"
    "  free: 30 mm in front of the wall; pressing: 6 mm behind its front; stroking: 8 mm, 0.1 m/s; entering, "
    "leaving:\n"
    "  while it is hidden. ghost: force on a HIP in front of the wall. error: against the true force; "
    "change: "
    "against the\n"
    "  force before the body set out. ms: the longest time above the limit.\n"
    "entries: where the HIP is in the solid: force of the body that was entered; none, and the state says "
    "behind; none\n"
    "  unsaid; another force. ghost: force outside. aside: along the motion where there is no side to come "
    "through.\n"
    "near: a surface comes nearer than near_m under a still HIP, waits two seconds and goes back.\n"
    "pushes: 45 mm deep beside silhouettes and the image's border; popped: gave way for good below 20 N.\n";

double lostPercent(const PassageResult& result) {
  return result.pressed == 0 ? 0
                             : 100 * static_cast<double>(result.lost) / static_cast<double>(result.pressed);
}

void addPassages(fmt::memory_buffer& text, const std::vector<PassageRow>& rows) {
  fmt::format_to(std::back_inserter(text),
                 "\n{:<9}{:>6}  {:<10}{:<10}{:>6}{:>5} |{:>9}{:>8}{:>7} |{:>9}{:>7} |{:>9}{:>7} |{:>7}\n",
                 "law", "wall m", "noise", "hand", "thick", "gap", "ghost N", "% >0.1", "ms", "error N",
                 "ms>0.5", "change N", "ms>0.5", "lost %");
  for (const PassageRow& row : rows) {
    const PassageResult& r = row.result;
    fmt::format_to(std::back_inserter(text),
                   "{:<9}{:>6.2f}  {:<10}{:<10}{:>6.0f}{:>5.0f} |{:>9.3f}{:>8.2f}{:>7} |{:>9.3f}{:>7} "
                   "|{:>9.3f}{:>7} |{:>7.2f}\n",
                   nameOf(row.law), row.wall_m, nameOf(row.noise), nameOf(row.hand), 1000 * row.thickness_m,
                   1000 * row.gap_m, r.ghost.largest, r.ghost.percent(), r.ghost.longest, r.error.largest,
                   r.error.longest, r.change.largest, r.change.longest, lostPercent(r));
  }
}

void addEntries(fmt::memory_buffer& text, const std::vector<EntryRow>& rows) {
  fmt::format_to(std::back_inserter(text),
                 "\n{:<9}{:>6}  {:<10}{:<14}{:>6} |{:>8}{:>11}{:>13}{:>8} |{:>9}{:>9}\n", "law", "wall m",
                 "noise", "entry", "below", "body %", "none said", "none unsaid", "wrong", "ghost N",
                 "aside N");
  for (const EntryRow& row : rows) {
    const EntryResult& r = row.result;
    const auto percent = [&r](std::size_t ticks) {
      return r.inside == 0 ? 0 : 100 * static_cast<double>(ticks) / static_cast<double>(r.inside);
    };
    fmt::format_to(
        std::back_inserter(text),
        "{:<9}{:>6.2f}  {:<10}{:<14}{:>6.0f} |{:>8.1f}{:>11.1f}{:>13.1f}{:>8.1f} |{:>9.3f}{:>9.3f}\n",
        nameOf(row.law), row.wall_m, nameOf(row.noise), nameOf(row.kind), 1000 * row.below_m,
        percent(r.of_body), percent(r.none_said), percent(r.none_unsaid), percent(r.wrong), r.ghost_n,
        r.sideways_n);
  }
}

void addNear(fmt::memory_buffer& text, const std::vector<NearRow>& rows) {
  fmt::format_to(std::back_inserter(text), "\n{:<9}{:>6} |{:>9}{:>9}{:>13}{:>9}  {:<12}{}\n", "law", "m/s",
                 "force N", "held ms", "released ms", "step N", "cause named", "came back");
  for (const NearRow& row : rows) {
    const NearLimitResult& r = row.result;
    fmt::format_to(std::back_inserter(text), "{:<9}{:>6.2f} |{:>9.3f}{:>9.0f}{:>13.0f}{:>9.3f}  {:<12}{}\n",
                   nameOf(row.law), row.speed_m_per_s, r.force_n, r.held_ms, r.released_ms, r.largest_step_n,
                   r.cause_named ? "yes" : "no", r.came_back ? "yes" : "no");
  }
}

void addPushes(fmt::memory_buffer& text, const std::vector<PushRow>& rows) {
  fmt::format_to(std::back_inserter(text), "\n{:<9}{:>6}  {:<10}{:<14}{:<9} |{:>8}{:>8}{:>9}\n", "law",
                 "wall m", "noise", "border", "moves", "pushes", "popped", "least N");
  for (const PushRow& row : rows) {
    fmt::format_to(std::back_inserter(text), "{:<9}{:>6.2f}  {:<10}{:<14}{:<9} |{:>8}{:>8}{:>9.2f}\n",
                   nameOf(row.law), row.wall_m, nameOf(row.noise), nameOf(row.kind),
                   row.surface_moves ? "surface" : "hand", row.result.pushes, row.result.popped,
                   row.result.least_n);
  }
}

Json passageJson(const PassageRow& row) {
  const PassageResult& r = row.result;
  return {{"law", nameOf(row.law)},
          {"wall_m", row.wall_m},
          {"noise", nameOf(row.noise)},
          {"hand", nameOf(row.hand)},
          {"thickness_m", row.thickness_m},
          {"gap_m", row.gap_m},
          {"passages", row.passages},
          {"ghost_largest_n", r.ghost.largest},
          {"ghost_percent", r.ghost.percent()},
          {"ghost_longest_ms", r.ghost.longest},
          {"error_largest_n", r.error.largest},
          {"error_longest_ms", r.error.longest},
          {"change_largest_n", r.change.largest},
          {"change_longest_ms", r.change.longest},
          {"lost_percent", lostPercent(r)}};
}

Json entryJson(const EntryRow& row) {
  return {{"law", nameOf(row.law)},
          {"wall_m", row.wall_m},
          {"noise", nameOf(row.noise)},
          {"entry", nameOf(row.kind)},
          {"below_m", row.below_m},
          {"ticks_inside", row.result.inside},
          {"of_body", row.result.of_body},
          {"none_said", row.result.none_said},
          {"none_unsaid", row.result.none_unsaid},
          {"wrong", row.result.wrong},
          {"ghost_n", row.result.ghost_n},
          {"sideways_n", row.result.sideways_n}};
}

Json nearJson(const NearRow& row) {
  return {{"law", nameOf(row.law)},
          {"speed_m_per_s", row.speed_m_per_s},
          {"force_n", row.result.force_n},
          {"held_ms", row.result.held_ms},
          {"least_held_n", row.result.least_held_n},
          {"released_ms", row.result.released_ms},
          {"largest_step_n", row.result.largest_step_n},
          {"cause_named", row.result.cause_named},
          {"came_back", row.result.came_back}};
}

Json pushJson(const PushRow& row) {
  return {{"law", nameOf(row.law)},
          {"wall_m", row.wall_m},
          {"noise", nameOf(row.noise)},
          {"border", nameOf(row.kind)},
          {"surface_moves", row.surface_moves},
          {"pushes", row.result.pushes},
          {"popped", row.result.popped},
          {"least_n", row.result.least_n}};
}

template <typename Rows, typename ToJson>
Json listOf(const Rows& rows, const ToJson& toJson) {
  Json list = Json::array();
  for (const auto& row : rows) list.push_back(toJson(row));
  return list;
}

}  // namespace

std::string occlusionTable(const OcclusionResult& result, const OcclusionOptions& options) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "{}", kExplanation);
  if (!result.passages.empty()) addPassages(text, result.passages);
  if (!result.entries.empty()) addEntries(text, result.entries);
  if (!result.near.empty()) addNear(text, result.near);
  if (!result.pushes.empty()) addPushes(text, result.pushes);
  fmt::format_to(std::back_inserter(text), "\nwhat must hold\n{}",
                 boundsTable(occlusionBounds(result, options)));
  return fmt::to_string(text);
}

std::string occlusionJson(const OcclusionResult& result, const OcclusionOptions& options) {
  Json document;
  document["passages"] = listOf(result.passages, passageJson);
  document["entries"] = listOf(result.entries, entryJson);
  document["near"] = listOf(result.near, nearJson);
  document["pushes"] = listOf(result.pushes, pushJson);
  document["bounds"] = Json::parse(boundsJson(occlusionBounds(result, options)));
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
