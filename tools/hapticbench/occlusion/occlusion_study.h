// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings.h"
#include "tools/hapticbench/occlusion/border_push.h"
#include "tools/hapticbench/occlusion/near_limit.h"
#include "tools/hapticbench/occlusion/passage.h"
#include "tools/hapticbench/occlusion/side_entry.h"
#include "tools/hapticbench/shipped_law.h"

namespace hapticd::tools {

/// What is measured.
enum class OcclusionPart : std::uint8_t {
  passages,  ///< bodies pass between the camera and the hand
  entries,   ///< hands enter from the side
  near,      ///< surfaces come nearer than the camera measures
  pushes,    ///< up to 20 N beside silhouettes and the image's border
};
std::string_view nameOf(OcclusionPart part);

struct OcclusionOptions {
  std::vector<OcclusionPart> parts{OcclusionPart::passages, OcclusionPart::entries, OcclusionPart::near,
                                   OcclusionPart::pushes};
  std::vector<config::LawChoice> laws{kShippedLaws.begin(), kShippedLaws.end()};
  std::vector<double> distances_m{1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor};
  std::vector<double> gaps_m{0.02, 0.04, 0.06, 0.1, 0.2, 0.3};
  std::vector<double> few_gaps_m{0.06, 0.2};  ///< for the hands that stroke, enter and leave
  std::vector<double> thicknesses_m{0.02, 0.08};
  std::vector<HandDuringPassage> hands{HandDuringPassage::free, HandDuringPassage::pressing,
                                       HandDuringPassage::stroking, HandDuringPassage::entering,
                                       HandDuringPassage::leaving};
  std::uint32_t seed = 1;
  bool one_passage = false;  ///< only a box that goes right; else one that comes back and pauses too,
                             ///< and without noise a round body without shadow
};

/// All passages of a hand behind bodies of one thickness with one gap.
struct PassageRow {
  config::LawChoice law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  HandDuringPassage hand = HandDuringPassage::free;
  double thickness_m = 0.08;
  double gap_m = 0.1;
  int passages = 0;
  PassageResult result;
};

/// All entries of a kind.
struct EntryRow {
  config::LawChoice law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  EntryKind kind = EntryKind::hidden_side;
  double below_m = 0.02;
  EntryResult result;
};

/// A surface that comes at that speed.
struct NearRow {
  config::LawChoice law;
  double speed_m_per_s = 0.1;
  NearLimitResult result;
};

/// All pushes beside a kind of border.
struct PushRow {
  config::LawChoice law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  BorderKind kind = BorderKind::image_border;
  bool surface_moves = false;
  BorderPushResult result;
};

struct OcclusionResult {
  std::vector<PassageRow> passages;
  std::vector<EntryRow> entries;
  std::vector<NearRow> near;
  std::vector<PushRow> pushes;
};

/// Calls `progress` with what is measured next.
OcclusionResult measureOcclusion(const OcclusionOptions& options,
                                 const std::function<void(const std::string&)>& progress);

}  // namespace hapticd::tools
