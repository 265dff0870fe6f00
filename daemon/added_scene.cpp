// SPDX-License-Identifier: Apache-2.0
#include "daemon/added_scene.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "rt/base/realtime_thread.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/fixtures/shape.h"

namespace hapticd::daemon {
namespace {

/// A position is seen by the pixels whose rays come this near.
constexpr double kRayDistance_m = 0.002;

/// Share of the fixtures' forces that is exerted: none while the box is not engaged. The stiffness limit,
/// which is also in Tick::gain, is in these forces already.
double exertedShare(const rt::Tick& tick) {
  return tick.stiffness_gain > 0 ? tick.gain / tick.stiffness_gain : 0;
}

}  // namespace

AddedScene::AddedScene(rt::ControlChannels& channels, const rt::DepthModel& depth_model,
                       const rt::PoseParameters& T_world_camera, const std::filesystem::path& state_folder)
    : channels_(channels),
      depth_model_(depth_model),
      T_world_camera_(T_world_camera),
      solids_(state_folder) {}

void AddedScene::returnUnusedMemory(bool memory_locked) {
  if (sets_) return;
  lock_when_used_ = memory_locked;
  channels_.fixtures.prepareSlots(
      [](rt::FixtureSet& slot) { rt::returnPages(slot.elements.data(), sizeof slot.elements); });
  channels_.tissue.prepareSlots(
      [](rt::TissueMap& slot) { rt::returnPages(slot.labels.data(), sizeof slot.labels); });
}

AddedScene::Sets& AddedScene::setsToChange() {
  if (sets_) return *sets_;
  sets_ = std::make_unique<Sets>();
  // Present and locked before the force loop reads it.
  if (lock_when_used_) {
    ::mlock(&channels_.fixtures, sizeof channels_.fixtures);
    ::mlock(&channels_.tissue, sizeof channels_.tissue);
  }
  return *sets_;
}

void AddedScene::apply(const config::SceneAdditions& additions, double tool_radius_m) {
  const bool other_tool = tool_radius_m != tool_radius_m_ && !additions.fixtures.empty();
  tool_radius_m_ = tool_radius_m;
  if (other_tool || additions.fixtures != additions_.fixtures || additions.frames != additions_.frames) {
    solids_.use(additions.fixtures, generations().fixtures + 1);
    additions_.frames = additions.frames;
    publishFixtures(additions.fixtures);
  }
  if (additions.regions != additions_.regions || additions.label_image != additions_.label_image) {
    ++regions_generation_;
    if (additions.label_image != additions_.label_image) readLabels(additions.label_image);
    publishRegions(additions.regions);
  }
}

void AddedScene::publishFixtures(const std::vector<config::FixtureSettings>& fixtures) {
  rt::FixtureSet& set = setsToChange().fixtures;
  config::toFixtureSet(fixtures, additions_.fixtures,
                       {T_world_camera_, additions_.frames, solids_.table(), tool_radius_m_}, set);
  additions_.fixtures = fixtures;
  channels_.fixtures.write(set);
}

AdditionGenerations AddedScene::generations() const {
  AdditionGenerations all;
  all.regions = regions_generation_;
  if (!sets_) return all;
  all.fixtures = sets_->fixtures.generation;
  // config::toFixtureSet() numbers a new definition by the generation and the place
  for (std::size_t i = 0; i < sets_->fixtures.count; ++i)
    all.each_fixture[i] = (sets_->fixtures.fixtures[i].definition - 1) / rt::kMaxFixtures;
  return all;
}

bool AddedScene::takeFiles(std::uint64_t fixtures_in_use) {
  const bool solids = solids_.takeLoaded();
  if (solids) publishFixtures(additions_.fixtures);
  solids_.release(fixtures_in_use);
  return takeLabels() || solids;
}

std::vector<TrackedSolid> AddedScene::trackedSolids() const {
  std::vector<TrackedSolid> tracked;
  for (const config::FrameSettings& frame : additions_.frames) {
    const auto fixture = std::ranges::find(additions_.fixtures, frame.tracks, &config::FixtureSettings::name);
    if (frame.tracks.empty() || fixture == additions_.fixtures.end()) continue;
    const auto solid = solids_.table().find(fixture->solid);
    if (solid == solids_.table().end()) continue;
    const auto place = static_cast<std::size_t>(fixture - additions_.fixtures.begin());
    const rt::Shape& shape = sets_->fixtures.fixtures.at(place).shape;
    tracked.push_back({.frame = config::frameIdentity(frame.name),
                       .solid = solid->second,
                       .T_frame_solid = {shape.position_m_in_world, shape.rotation}});
  }
  return tracked;
}

/// Reads the image on a thread of its own, because the disk may not respond.
void AddedScene::readLabels(const std::string& file) {
  additions_.label_image = file;
  labels_ = {};
  warning_.clear();
  loading_ = {};
  if (!file.empty()) loading_ = worker_.run([file] { return config::loadLabelImage(file); });
}

bool AddedScene::takeLabels() {
  if (!loading_.valid() || loading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    return false;
  auto labels = loading_.get();
  if (!labels) {
    warning_ = labels.error().text();
    return false;
  }
  labels_ = std::move(*labels);
  publishRegions(additions_.regions);
  return true;
}

void AddedScene::followStiffness(const std::vector<config::RegionSettings>& regions) {
  if (regions != additions_.regions) publishRegions(regions);
}

void AddedScene::publishRegions(const std::vector<config::RegionSettings>& regions) {
  rt::TissueMap& tissue = setsToChange().tissue;
  config::toTissueMap(regions, additions_.regions, labels_, T_world_camera_, tissue);
  additions_.regions = regions;
  channels_.tissue.write(tissue);
}

std::string AddedScene::warning(const rt::DepthModelParameters& camera) const {
  if (!warning_.empty() || !sets_ || !sets_->tissue.has_labels || sets_->tissue.hasLabelsFor(camera))
    return warning_;
  return fmt::format(
      "regions of place label have no effect: the label image has {} x {} pixels and the camera's frames "
      "have {} x {} (draw it over a depth image of this camera)",
      sets_->tissue.label_width_px, sets_->tissue.label_height_px, camera.width_px, camera.height_px);
}

FixtureStatus AddedScene::fixtureStatus(const rt::LoopState& loop, double warning_m) const {
  const rt::Tick& tick = loop.tick;
  const auto& fixtures = additions_.fixtures;
  const double share = exertedShare(tick);
  FixtureStatus status;
  status.generation = generations().fixtures;
  status.count = fixtures.size();
  status.enabled =
      static_cast<std::uint64_t>(std::ranges::count_if(fixtures, &config::FixtureSettings::enabled));
  status.force_n = share * rt::norm(tick.fixture_force_n_in_world);
  status.guidance_force_n = share * rt::norm(tick.guidance_force_n_in_world);
  // Places in an older set may mean other fixtures.
  if (tick.fixture_generation != status.generation) return status;
  for (std::size_t i = 0; i < fixtures.size() && i < rt::kMaxFixtures; ++i) {
    const bool exerts = share > 0 && (tick.fixtures_in_contact >> i & 1U) != 0;
    if (exerts) status.in_contact.push_back(fixtures[i].name);
    const rt::FixtureState& state = loop.fixtures[i];
    status.warning |= state.stage == rt::FixtureStage::warning || state.stage == rt::FixtureStage::soft;
    const bool slows = fixtures[i].effect == rt::FixtureEffect::slow;
    status.each.push_back({.name = fixtures[i].name,
                           .configured_n_per_m = slows ? 0 : fixtures[i].stiffness_n_per_m,
                           .stiffness_n_per_m = state.stiffness_n_per_m,
                           .force_n = share * state.force_n,
                           .distance_m = state.distance_m,
                           .stage = state.stage,
                           .warnings = state.warnings,
                           .breach = state.breach,
                           .breaches = state.breaches,
                           .lag_m = state.lag_m});
  }
  if (tick.nearest_fixture < 0 || static_cast<std::size_t>(tick.nearest_fixture) >= fixtures.size())
    return status;
  status.nearest = fixtures[static_cast<std::size_t>(tick.nearest_fixture)].name;
  status.distance_m = tick.fixture_distance_m;
  status.warning |= tick.fixture_distance_m < warning_m;
  return status;
}

std::vector<FrameStatus> AddedScene::frameStatus(const rt::LoopState& loop) const {
  std::vector<FrameStatus> all;
  const bool known = loop.tick.fixture_generation == generations().fixtures;
  for (std::size_t i = 0; i < additions_.frames.size() && i < rt::kMaxFrames; ++i) {
    FrameStatus& status = all.emplace_back();
    status.name = additions_.frames[i].name;
    status.tracks = additions_.frames[i].tracks;
    status.used = std::ranges::any_of(additions_.fixtures, [&](const config::FixtureSettings& fixture) {
      return fixture.enabled && fixture.frame == status.name;
    });
    if (!known) continue;
    const rt::FrameConduct& conduct = loop.frames[i];
    const auto dropped = [&conduct](rt::PoseFault fault) {
      return conduct.dropped[static_cast<std::size_t>(fault)];
    };
    status.state = conduct.state;
    if (conduct.fault != rt::PoseFault::none) status.refusal = conduct.fault;
    status.age_s = conduct.age_s;
    status.lag_m = conduct.lag_m;
    status.lag_rad = conduct.lag_rad;
    status.position_m_in_world = conduct.T_world_frame.position_m_in_world;
    status.orientation = conduct.T_world_frame.orientation;
    status.accepted = conduct.accepted;
    status.not_finite = dropped(rt::PoseFault::not_finite);
    status.not_unit = dropped(rt::PoseFault::not_unit);
    status.older = dropped(rt::PoseFault::older);
    status.future = dropped(rt::PoseFault::future);
    status.jumps = dropped(rt::PoseFault::jump);
    status.repeated = dropped(rt::PoseFault::repeated);
    status.identity = dropped(rt::PoseFault::identity);
    status.losses = conduct.losses;
    status.returns = conduct.returns;
    status.relocations = conduct.relocations;
  }
  return all;
}

TissueStatus AddedScene::tissueStatus(const rt::Tick& tick) const {
  TissueStatus status;
  status.generation = regions_generation_;
  status.count = additions_.regions.size();
  const bool known = sets_ && tick.tissue_generation == sets_->tissue.generation && tick.tissue_region >= 0 &&
                     static_cast<std::size_t>(tick.tissue_region) < additions_.regions.size();
  if (known) status.in_contact = additions_.regions[static_cast<std::size_t>(tick.tissue_region)].name;
  return status;
}

std::uint8_t AddedScene::labelAt(const rt::Vec3& position_m_in_world) const {
  if (!sets_ || !sets_->tissue.hasLabelsFor(depth_model_.parameters()) ||
      depth_model_.positionInCamera(position_m_in_world).z >= 0)
    return 0;
  const rt::PixelWindow pixels = depth_model_.pixelsOfBall(position_m_in_world, kRayDistance_m);
  if (pixels.empty()) return 0;
  const auto column = static_cast<std::size_t>((pixels.column_first + pixels.column_last) / 2);
  const auto row = static_cast<std::size_t>((pixels.row_first + pixels.row_last) / 2);
  return sets_->tissue.labels[row * static_cast<std::size_t>(sets_->tissue.label_width_px) + column];
}

std::optional<std::size_t> AddedScene::regionAt(const rt::Vec3& position_m_in_world) const {
  if (!sets_) return std::nullopt;
  const std::uint8_t label = labelAt(position_m_in_world);
  for (std::size_t i = sets_->tissue.count; i-- > 0;) {
    const rt::TissueRegion& region = sets_->tissue.regions[i];
    const bool inside = region.place == rt::TissuePlace::label
                            ? label != 0 && region.label == label
                            : rt::distanceFrom(region.shape, position_m_in_world).distance_m <= 0;
    if (inside) return i;
  }
  return std::nullopt;
}

}  // namespace hapticd::daemon
