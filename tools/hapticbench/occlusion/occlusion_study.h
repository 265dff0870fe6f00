// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/hapticbench/law_setting.h"
#include "tools/hapticbench/occlusion/border_push.h"
#include "tools/hapticbench/occlusion/near_limit.h"
#include "tools/hapticbench/occlusion/passage.h"
#include "tools/hapticbench/occlusion/side_entry.h"

namespace hapticd::tools {

/// A part of the study.
enum class OcclusionPart : std::uint8_t {
  passages,  ///< bodies pass between the camera and the hand
  entries,   ///< hands enter from the side
  near,      ///< surfaces come nearer than the camera measures
  pushes,    ///< up to 20 N beside silhouettes and the image's border
};
std::string_view nameOf(OcclusionPart part);

inline constexpr std::array kAllParts{OcclusionPart::passages, OcclusionPart::entries, OcclusionPart::near,
                                      OcclusionPart::pushes};

struct OcclusionOptions {
  std::vector<OcclusionPart> parts{kAllParts.begin(), kAllParts.end()};
  std::vector<std::string> laws = kProxyLawChoices;
  std::vector<double> distances_m{1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor};
  std::vector<double> gaps_m{0.02, 0.04, 0.06, 0.1, 0.2, 0.3};
  std::vector<double> few_gaps_m{0.06, 0.2};  ///< for the hands that stroke, enter and leave
  std::vector<double> thicknesses_m{0.02, 0.08};
  std::vector<HandDuringPassage> hands{kAllHands.begin(), kAllHands.end()};
  std::uint32_t seed = 1;
  bool one_passage = false;  ///< only a box that goes right; else also one that pauses and goes left, and
                             ///< without noise a round body without shadow
};

/// All passages of a hand behind bodies of one thickness with one gap.
struct PassageRow {
  std::string law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  HandDuringPassage hand = HandDuringPassage::free;
  double thickness_m = 0.08;
  double gap_m = 0.1;
  int passages = 0;
  PassageResult result{};
};

/// The entries of one kind.
struct EntryRow {
  std::string law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  EntryKind kind = EntryKind::hidden_side;
  double below_m = 0.02;
  EntryResult result{};
};

/// The near limit, for a surface that approaches at one speed.
struct NearRow {
  std::string law;
  double speed_m_per_s = 0.1;
  NearLimitResult result{};
};

/// The pushes beside one kind of border.
struct PushRow {
  std::string law;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  BorderKind kind = BorderKind::image_border;
  bool surface_moves = false;
  BorderPushResult result{};
};

struct OcclusionResult {
  OcclusionOptions options{};
  std::vector<PassageRow> passages{};
  std::vector<EntryRow> entries{};
  std::vector<NearRow> near{};
  std::vector<PushRow> pushes{};
};

/// Calls `progress` with what is measured next.
OcclusionResult measureOcclusion(const OcclusionOptions& options,
                                 const std::function<void(const std::string&)>& progress);

/// The figures and the requirements, for people and for programs.
std::string occlusionText(const OcclusionResult& result);
std::string occlusionJson(const OcclusionResult& result);

}  // namespace hapticd::tools
