// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_bounds.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {
namespace {

/// From there on nothing of the body's depth, which nobody can know, reaches the HIP: the solid behind a
/// visible surface is taken to be 35 mm thick, and 60 mm is the least that must be free.
constexpr double kClearGap_m = 0.0599;
constexpr double kThick_m = 0.08;

/// The passages of a law with one noise that `belongs` holds for, as one.
template <typename Belongs>
PassageResult together(const OcclusionResult& result, config::LawChoice law, SceneNoise noise,
                       const Belongs& belongs) {
  PassageResult all;
  for (const PassageRow& row : result.passages) {
    if (row.law == law && row.noise == noise && belongs(row)) all.add(row.result);
  }
  return all;
}

bool isClear(const PassageRow& row) {
  return row.gap_m >= kClearGap_m && row.thickness_m <= kThick_m;
}

void addPassageBounds(const OcclusionResult& result, config::LawChoice law, SceneNoise noise,
                      std::vector<Bound>& bounds) {
  const std::string name(nameOf(law));
  const std::string with = fmt::format(", noise {}", nameOf(noise));
  const auto free = [](const PassageRow& row) { return row.hand == HandDuringPassage::free; };
  const PassageResult clear =
      together(result, law, noise, [&](const PassageRow& row) { return free(row) && isClear(row); });
  const PassageResult close =
      together(result, law, noise, [&](const PassageRow& row) { return free(row) && !isClear(row); });
  const PassageResult pressing = together(result, law, noise, [](const PassageRow& row) {
    return row.hand == HandDuringPassage::pressing && isClear(row);
  });
  const PassageResult stroking = together(result, law, noise, [](const PassageRow& row) {
    return row.hand == HandDuringPassage::stroking && isClear(row);
  });
  if (clear.ghost.ticks > 0) {
    bounds.push_back(Bound::atMost(name, "force on a free HIP, a body 60 to 300 mm before it" + with, 0.1,
                                   clear.ghost.largest, "N"));
    bounds.push_back(Bound::atMost(name, "the same, ticks above 0.1 N", 0, clear.ghost.percent(), "%"));
  }
  if (close.ghost.ticks > 0)
    bounds.push_back(Bound::atMost(name, "force on a free HIP, a body 20 to 60 mm before it" + with, 1,
                                   close.ghost.largest, "N"));
  if (pressing.pressed > 0) {
    // With noise the error holds the sensor's own; what the passage adds is the change.
    const Exceedance& judged = noise == SceneNoise::none ? pressing.error : pressing.change;
    bounds.push_back(Bound::atMost(name, "error of a pressing HIP above 0.5 N while a body passes" + with,
                                   100, static_cast<double>(judged.longest), "ms"));
  }
  if (stroking.pressed > 0)
    bounds.push_back(
        Bound::atMost(name, "contact lost in strokes while a body passes" + with, 0,
                      100 * static_cast<double>(stroking.lost) / static_cast<double>(stroking.pressed), "%"));
}

void addEntryBounds(const OcclusionResult& result, config::LawChoice law, std::vector<Bound>& bounds) {
  EntryResult all;
  double border_n = 0;
  for (const EntryRow& row : result.entries) {
    if (row.law != law || row.noise != SceneNoise::none) continue;
    all.add(row.result);
    const bool at_border = row.kind == EntryKind::into_image || row.kind == EntryKind::out_of_image;
    if (at_border) border_n = std::max(border_n, row.result.sideways_n);
  }
  if (all.inside == 0) return;
  const std::string name(nameOf(law));
  const auto percent = [&all](std::size_t ticks) {
    return 100 * static_cast<double>(ticks) / static_cast<double>(all.inside);
  };
  bounds.push_back(Bound::atMost(name, "entries from the side: another force than the body's", 0,
                                 percent(all.wrong), "%"));
  bounds.push_back(Bound::atMost(name, "entries from the side: no force, and nothing says so", 0,
                                 percent(all.none_unsaid), "%"));
  bounds.push_back(
      Bound::atMost(name, "entries from the side: force outside the body", 0.1, all.ghost_n, "N"));
  bounds.push_back(Bound::atMost(name, "force sideways at the image's border", 0.2, border_n, "N"));
}

void addNearBounds(const OcclusionResult& result, config::LawChoice law, std::vector<Bound>& bounds) {
  // safety.depth_timeout_s; and that with safety.depth_ramp_s, after ten frames in which what is missing may
  // only flicker, and a tenth more.
  constexpr double kLeastHeld_ms = 500;
  constexpr double kLatestRelease_ms = 1130;
  double least_held_ms = 1e9;
  double latest_ms = 0;
  int unnamed = 0;
  int rows = 0;
  for (const NearRow& row : result.near) {
    if (row.law != law) continue;
    ++rows;
    least_held_ms = std::min(least_held_ms, row.result.held_ms);
    latest_ms = row.result.released_ms < 0 ? 1e9 : std::max(latest_ms, row.result.released_ms);
    unnamed += row.result.cause_named ? 0 : 1;
  }
  if (rows == 0) return;
  const std::string name(nameOf(law));
  bounds.push_back(Bound::atLeast(name, "a surface nearer than near_m: the force is held for", kLeastHeld_ms,
                                  least_held_ms, "ms"));
  bounds.push_back(
      Bound::atMost(name, "the same: the force is released after", kLatestRelease_ms, latest_ms, "ms"));
  bounds.push_back(Bound::atMost(name, "the same: without its own cause", 0, unnamed, "runs"));
}

void addPushBounds(const OcclusionResult& result, config::LawChoice law, std::vector<Bound>& bounds) {
  BorderPushResult all;
  for (const PushRow& row : result.pushes) {
    if (row.law == law) all.add(row.result);
  }
  if (all.pushes == 0) return;
  bounds.push_back(
      Bound::atMost(std::string(nameOf(law)),
                    fmt::format("pop-through below 20 N beside borders, of {} pushes", all.pushes), 0,
                    all.popped, "pushes"));
}

}  // namespace

std::vector<Bound> occlusionBounds(const OcclusionResult& result, const OcclusionOptions& options) {
  std::vector<Bound> bounds;
  for (const config::LawChoice law : options.laws) {
    for (const SceneNoise noise : options.noises) addPassageBounds(result, law, noise, bounds);
    addEntryBounds(result, law, bounds);
    addNearBounds(result, law, bounds);
    addPushBounds(result, law, bounds);
  }
  return bounds;
}

}  // namespace hapticd::tools
