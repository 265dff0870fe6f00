#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/settings.h"
#include "tools/hapticbench/occlusion/passage.h"
#include "tools/hapticbench/shipped_law.h"

namespace hapticd::tools {

struct OcclusionOptions {
  std::vector<config::LawChoice> laws{kShippedLaws.begin(), kShippedLaws.end()};
  std::vector<double> distances_m{1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor};
  std::vector<double> gaps_m{0.02, 0.04, 0.06, 0.1, 0.2, 0.3};
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
  config::LawChoice law = config::LawChoice::automatic;
  double wall_m = 1;
  SceneNoise noise = SceneNoise::none;
  HandDuringPassage hand = HandDuringPassage::free;
  double thickness_m = 0.08;
  double gap_m = 0.1;
  int passages = 0;
  PassageResult result;
};

struct OcclusionResult {
  std::vector<PassageRow> passages;
};

/// Calls `progress` with what is measured next.
OcclusionResult measureOcclusion(const OcclusionOptions& options,
                                 const std::function<void(const std::string&)>& progress);

}  // namespace hapticd::tools
