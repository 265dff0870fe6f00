// SPDX-License-Identifier: Apache-2.0
#include "daemon/added_scene.h"

#include <algorithm>
#include <cmath>

#include "daemon/base/label_image.h"
#include "rt/vec3.h"

namespace hapticd::daemon {

AddedScene::AddedScene(rt::ControlChannels& channels, const rt::PoseParameters& T_world_camera)
    : channels_(channels),
      T_world_camera_(T_world_camera),
      fixtures_(std::make_unique<rt::FixtureSet>()),
      tissue_(std::make_unique<rt::TissueMap>()) {}

void AddedScene::apply(const config::SceneAdditions& additions) {
  if (additions.fixtures != additions_.fixtures) {
    config::toFixtureSet(additions.fixtures, additions_.fixtures, T_world_camera_, *fixtures_);
    additions_.fixtures = additions.fixtures;
    channels_.fixtures.write(*fixtures_);
  }
  if (additions.regions != additions_.regions || additions.label_image != additions_.label_image) {
    ++regions_generation_;
    additions_.label_image = additions.label_image;
    publishRegions(additions.regions);
  }
}

void AddedScene::applyStiffness(const std::vector<config::RegionSettings>& regions) {
  if (regions != additions_.regions) publishRegions(regions);
}

void AddedScene::publishRegions(const std::vector<config::RegionSettings>& regions) {
  config::toTissueMap(regions, additions_.regions, labelsOf(additions_), T_world_camera_, *tissue_);
  additions_.regions = regions;
  channels_.tissue.write(*tissue_);
}

double AddedScene::standoffClearance_m() const {
  double largest_m = 0;
  for (const config::FixtureSettings& fixture : additions_.fixtures) {
    if (fixture.enabled && fixture.kind == rt::FixtureKind::standoff)
      largest_m = std::max(largest_m, fixture.clearance_m);
  }
  return largest_m;
}

FixtureStatus AddedScene::fixtureStatus(const rt::Tick& tick, double warning_m) const {
  const auto& fixtures = additions_.fixtures;
  FixtureStatus status;
  status.generation = fixtures_->generation;
  status.count = fixtures.size();
  status.enabled =
      static_cast<std::uint64_t>(std::ranges::count_if(fixtures, &config::FixtureSettings::enabled));
  status.force_n = rt::norm(tick.fixture_force_n_in_world);
  status.guidance_force_n = rt::norm(tick.guidance_force_n_in_world);
  // Places in an older set may mean other fixtures.
  if (tick.fixture_generation != fixtures_->generation) return status;
  for (std::size_t i = 0; i < fixtures.size(); ++i) {
    if ((tick.fixtures_in_contact >> i & 1U) != 0) status.in_contact.push_back(fixtures[i].name);
  }
  if (tick.nearest_fixture < 0 || static_cast<std::size_t>(tick.nearest_fixture) >= fixtures.size())
    return status;
  status.nearest = fixtures[static_cast<std::size_t>(tick.nearest_fixture)].name;
  status.distance_m = tick.fixture_distance_m;
  status.warning = tick.fixture_distance_m < warning_m;
  return status;
}

TissueStatus AddedScene::tissueStatus(const rt::Tick& tick) const {
  TissueStatus status;
  status.generation = regions_generation_;
  status.count = additions_.regions.size();
  const bool known = tick.tissue_generation == tissue_->generation && tick.tissue_region >= 0 &&
                     static_cast<std::size_t>(tick.tissue_region) < additions_.regions.size();
  if (known) status.in_contact = additions_.regions[static_cast<std::size_t>(tick.tissue_region)].name;
  return status;
}

}  // namespace hapticd::daemon
