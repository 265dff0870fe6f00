// SPDX-License-Identifier: Apache-2.0
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
  bool filtered = false;                                      ///< kFilterOn; of the laws on points
  int fusion_frames = rt::SurfaceParameters{}.fusion_frames;  ///< of the law `surface`

  friend auto operator<=>(const LawSetting&, const LawSetting&) = default;
};

/// As it stands in tables: the law, and what is not as shipped.
std::string nameOf(const LawSetting& setting);

/// The laws on points, filtered or not, and `surface` as shipped.
std::vector<LawSetting> shippedSettings();

/// Those, and `surface` without its mean over frames.
std::vector<LawSetting> allSettings();

/// A box that computes with that setting.
std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera);

}  // namespace hapticd::tools
