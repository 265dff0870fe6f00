// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/laws.h"

#include <fmt/format.h>

#include <array>
#include <memory>

#include "config/base/counted.h"
#include "config/settings/settings.h"

namespace hapticd::tools {

using rt::ForceLaw;

std::string nameOf(const LawSetting& setting) {
  std::string name(nameOf(setting.law));
  if (setting.filtered) name += ", filtered";
  const int frames = setting.fusion_frames;
  if (frames != LawSetting{}.fusion_frames) name += ", " + base::counted(frames, "frame(s)");
  return name;
}

std::vector<LawSetting> shippedSettings() {
  std::vector<LawSetting> settings;
  for (const rt::ForceLawRow& row : rt::kForceLaws) {
    settings.push_back({.law = row.law});
    if (row.reads_filtered) settings.push_back({.law = row.law, .filtered = true});
  }
  return settings;
}

std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  rt::LiveParameters& live = box->parameters();
  live.law = setting.law;
  live.surface.fusion_frames = setting.fusion_frames;
  if (setting.filtered) live.filter = config::filterOfChoice();
  live.safety.max_force_n = 1e6;
  live.safety.max_slew_n_per_s = 1e9;
  return box;
}

rt::LiveParameters shippedParameters(const std::string& choice, double distance_m,
                                     const rt::DepthModelParameters& camera) {
  const config::Settings shipped;
  if (choice == config::kAutomaticLaw) {
    const config::SurfaceAsSeen seen = config::asSeenBy(camera, distance_m);
    return config::liveWith(shipped, config::chooseLaw(shipped, seen));
  }
  rt::LiveParameters live = shipped.effectiveLive();
  live.law = rt::withWord<ForceLaw>(choice).value_or(live.law);
  return live;
}

std::unique_ptr<OfflineBox> boxWith(const rt::LiveParameters& parameters,
                                    const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  const double engage_ramp_s = box->parameters().safety.engage_ramp_s;
  box->parameters() = parameters;
  box->parameters().safety.engage_ramp_s = engage_ramp_s;
  return box;
}

std::unique_ptr<OfflineBox> shippedBox(const std::string& choice, double distance_m,
                                       const rt::DepthModelParameters& camera) {
  return boxWith(shippedParameters(choice, distance_m, camera), camera);
}

namespace {

constexpr double kTickPeriod_s = 0.001;
constexpr std::int64_t kTickPeriod_ns = 1'000'000;

}  // namespace

FrameStream renderedStream(
    const std::function<void(long tick, std::uint64_t number, rt::DepthFrame& frame)>& render) {
  const auto frames = std::make_shared<std::array<rt::DepthFrame, 2>>();
  return {[frames, render](int index) -> const rt::DepthFrame& {
            rt::DepthFrame& frame = (*frames)[static_cast<std::size_t>(index % 2)];
            render(tickOfRegularFrame(index), static_cast<std::uint64_t>(index) + 1, frame);
            frame.arrival_ns = tickOfRegularFrame(index) * kTickPeriod_ns;
            return frame;
          },
          tickOfRegularFrame};
}

rt::Tick FramePlayer::tick(const rt::Vec3& hip_m_in_world) {
  frame_is_new_ = false;
  while (stream_.arrival_tick(frame_ + 1) <= next_tick_) {
    ++frame_;
    box_.show(stream_.frame(frame_), next_tick_ * kTickPeriod_ns);
    frame_is_new_ = true;
  }
  const rt::Vec3 velocity =
      next_tick_ == 0 ? rt::Vec3{} : (1 / kTickPeriod_s) * (hip_m_in_world - hip_before_);
  hip_before_ = hip_m_in_world;
  ++next_tick_;
  return box_.tick(hip_m_in_world, kTickPeriod_s, velocity);
}

}  // namespace hapticd::tools
