#pragma once

#include <compare>
#include <memory>
#include <string>
#include <vector>

#include "rt/parameters.h"
#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/offline/offline_box.h"

namespace hapticd::tools {

/// A force law and what of its settings changes its cost or its error. Ordered by its members in turn.
struct LawSetting {
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  double voxel_edge_m = kUsualVoxelEdge_m;  ///< of the law `surface`
  bool filtered = false;                    ///< kFilterOn
  int fusion_frames = 1;                    ///< of the law `surface`

  friend auto operator<=>(const LawSetting&, const LawSetting&) = default;
};

/// As it stands in tables: the law, and what is not as usual.
std::string nameOf(const LawSetting& setting);

/// Every law, filtered or not; `surface` with each of the voxel edges and with 1 and 8 fused frames.
std::vector<LawSetting> allSettings();

/// A box that computes with that setting.
std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera);

}  // namespace hapticd::tools
