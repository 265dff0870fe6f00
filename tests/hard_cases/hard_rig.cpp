// SPDX-License-Identifier: Apache-2.0
#include "tests/hard_cases/hard_rig.h"

#include <algorithm>
#include <cmath>

#include "config/settings/law_choice.h"
#include "drivers/camera/kinect_image.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::test {

HardRig::HardRig(rt::ForceLaw law, const rt::DepthModelParameters& depth_model,
                 const rt::GridParameters& grid)
    : box(depth_model, {}, grid) {
  constexpr double kFarAway = 1e9;
  box.parameters().law = law;
  box.parameters().safety.max_force_n = kFarAway;
  box.parameters().safety.max_slew_n_per_s = kFarAway;
  frame_->sequence = 0;
  frame_->arrival_ns = 0;
}

void HardRig::show(const std::function<void(rt::DepthFrame&)>& fill) {
  const std::uint64_t sequence = frame_->sequence + 1;
  fill(*frame_);
  frame_->sequence = sequence;
  box.show(*frame_);
}

void HardRig::show(tools::TrueScene& scene, double t_s, tools::SceneNoise noise) {
  show([&](rt::DepthFrame& frame) { scene.render(t_s, frame.sequence + 1, noise, frame); });
}

void HardRig::showConstant(std::uint16_t raw) {
  show([raw](rt::DepthFrame& frame) { std::fill_n(frame.raw, drivers::kKinectPixels, raw); });
}

rt::Tick HardRig::moveTo(const rt::Vec3& to_m_in_world, double step_m) {
  const rt::Vec3 from = hip_;
  const rt::Vec3 displacement = to_m_in_world - from;
  const int steps = std::max(1, static_cast<int>(std::ceil(norm(displacement) / step_m)));
  rt::Tick last;
  for (int step = 1; step <= steps; ++step) {
    hip_ = from + (static_cast<double>(step) / steps) * displacement;
    last = tick(hip_);
  }
  return last;
}

rt::DepthModelParameters fineCameraFor(double distance_m) {
  return tools::fineDepthModel(distance_m - 0.25, distance_m + 0.25);
}

INSTANTIATE_TEST_SUITE_P(Law, EachLaw,
                         testing::Values(rt::ForceLaw::nearest_springs, rt::ForceLaw::smooth_springs,
                                         rt::ForceLaw::proxy, rt::ForceLaw::surface),
                         [](const auto& law) { return std::string(config::nameOf(law.param)); });
INSTANTIATE_TEST_SUITE_P(Law, EachConstraint, testing::Values(rt::ForceLaw::proxy, rt::ForceLaw::surface),
                         [](const auto& law) { return std::string(config::nameOf(law.param)); });

}  // namespace hapticd::test
