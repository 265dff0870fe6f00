// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/settings/fixture_settings.h"
#include "config/settings/label_image.h"
#include "daemon/base/box.h"
#include "daemon/scene/scene_thread.h"
#include "daemon/state/solid_store.h"
#include "daemon/state/state_file.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_model.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

/// Hands fixtures and tissue regions to the force loop, and names those of which its ticks know only the
/// place. Thread: control thread only.
class AddedScene {
 public:
  /// `channels` and `depth_model` must outlive the object. `state_folder`: holds the solids.
  AddedScene(rt::ControlChannels& channels, const rt::DepthModel& depth_model,
             const rt::PoseParameters& T_world_camera, const std::filesystem::path& state_folder);

  /// Hands over what differs from the last call; nothing as long as there has never been a fixture or region.
  void apply(const config::SceneAdditions& additions, double tool_radius_m);
  /// Returns the memory of paths and labels to the system until there is a fixture or region. To be called
  /// after memory is locked, which `memory_locked` tells, and before the force loop runs.
  void returnUnusedMemory(bool memory_locked);
  /// Waits until the solids of these fixtures are in memory, or cannot be read. To be called before apply().
  void loadSolids(const std::vector<config::FixtureSettings>& fixtures) { solids_.load(fixtures); }
  /// Takes a label image and solids that have been read meanwhile, and hands them over. Returns whether it
  /// did. `fixtures_in_use`: FixtureSet::generation of the force loop.
  bool takeFiles(std::uint64_t fixtures_in_use);
  /// Hands over regions that differ in their stiffness and damping only, which generations() does not count.
  void followStiffness(const std::vector<config::RegionSettings>& regions);

  AdditionGenerations generations() const;
  /// `warning_m`: nearer than that to a forbidden region is a warning.
  FixtureStatus fixtureStatus(const rt::LoopState& loop, double warning_m) const;
  /// Without FrameStatus::limited.
  std::vector<FrameStatus> frameStatus(const rt::LoopState& loop) const;
  TissueStatus tissueStatus(const rt::Tick& tick) const;
  /// The region that covers a position, as an index; nothing: none does.
  std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const;
  SolidStore& solids() { return solids_; }
  const SolidStore& solids() const { return solids_; }
  double toolRadius_m() const { return tool_radius_m_; }
  /// The solids by which the depth camera finds frames, as far as they are in memory.
  std::vector<TrackedSolid> trackedSolids() const;
  /// Returns why the label image has no effect with a camera of this description, and the remedy; empty: it
  /// has, or there is none.
  std::string warning(const rt::DepthModelParameters& camera) const;

  /// The whole sets as the force loop has them.
  struct Sets {
    rt::FixtureSet fixtures;
    rt::TissueMap tissue;
  };
  /// Null: there has never been a fixture or region.
  const Sets* sets() const { return sets_.get(); }

 private:
  Sets& setsToChange();
  void publishFixtures(const std::vector<config::FixtureSettings>& fixtures);
  bool takeLabels();
  void publishRegions(const std::vector<config::RegionSettings>& regions);
  void readLabels(const std::string& file);
  std::uint8_t labelAt(const rt::Vec3& position_m_in_world) const;

  rt::ControlChannels& channels_;
  const rt::DepthModel& depth_model_;
  const rt::PoseParameters T_world_camera_;
  config::SceneAdditions additions_;
  double tool_radius_m_ = 0;
  // large, and kept because each change continues the identities of the one before
  std::unique_ptr<Sets> sets_;
  bool lock_when_used_ = false;  // the memory of the channels was returned
  std::uint64_t regions_generation_ = 0;
  SolidStore solids_;
  config::LabelImage labels_;
  std::future<base::Result<config::LabelImage>> loading_;
  std::string warning_;
  StateWorker worker_{std::chrono::seconds(1)};  // a job that only reads may be abandoned soon
};

}  // namespace hapticd::daemon
