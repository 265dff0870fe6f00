// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "config/fixture_settings.h"
#include "daemon/base/box.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"

namespace hapticd::daemon {

/// Hands fixtures and tissue regions to the force loop, and names those of which its ticks know only the
/// place. Thread: control thread only.
class AddedScene {
 public:
  AddedScene(rt::ControlChannels& channels, const rt::PoseParameters& T_world_camera);

  /// Hands over what differs from the last call; nothing as long as there has never been a fixture or region.
  void apply(const config::SceneAdditions& additions);
  /// Hands over regions that differ in their stiffness only.
  void applyStiffness(const std::vector<config::RegionSettings>& regions);

  AdditionGenerations generations() const { return {fixtures_->generation, regions_generation_}; }
  /// Largest clearance of the enabled stand-off fixtures; 0: there is none.
  double standoffClearance_m() const;
  /// `warning_m`: nearer than that to a forbidden region is a warning.
  FixtureStatus fixtureStatus(const rt::Tick& tick, double warning_m) const;
  TissueStatus tissueStatus(const rt::Tick& tick) const;

  /// The whole sets as the force loop has them.
  const rt::FixtureSet& fixtures() const { return *fixtures_; }
  const rt::TissueMap& tissue() const { return *tissue_; }

 private:
  void publishRegions(const std::vector<config::RegionSettings>& regions);

  rt::ControlChannels& channels_;
  const rt::PoseParameters T_world_camera_;
  config::SceneAdditions additions_;
  // large, and kept because each change continues the identities of the one before
  const std::unique_ptr<rt::FixtureSet> fixtures_;
  const std::unique_ptr<rt::TissueMap> tissue_;
  std::uint64_t regions_generation_ = 0;
};

}  // namespace hapticd::daemon
