// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/setting_error.h"

#include <algorithm>
#include <optional>

#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/accuracy/course.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr std::uint32_t kSeed = 1;  // as in AccuracyOptions

bool takesAMean(const LawSetting& setting) {
  return setting.filtered || (setting.law == rt::ForceLaw::surface && setting.fusion_frames > 1);
}

/// Adds the errors along one course. Where the model lacks a part the force of the tick before stays, as in
/// the core.
void follow(const Course& course, FrameReel& reel, OfflineBox& box, int first_frame, ForceErrors& errors) {
  for (int frame = first_frame; frame < kSettlingFrames; ++frame) {
    box.show(reel.frame(frame));
    box.lawForce(course.ticks.front().hip_m);
  }
  int shown = -1;
  Vec3 force_n;
  for (const CourseTick& tick : course.ticks) {
    if (tick.frame != shown) box.show(reel.frame(tick.frame));
    shown = tick.frame;
    const rt::ForceSample sample = box.lawForce(tick.hip_m);
    if (!sample.outside_model) force_n = sample.force_n_in_world;
    if (tick.sample == SamplePlace::behind) errors.add(force_n, tick.ideal_force_n);
  }
}

std::vector<Course> coursesOf(const TrueScene& scene, bool moves, int pushes_per_scene) {
  const double stiffness = rt::SpringParameters{}.stiffness_n_per_m;
  if (!moves) return pushes(scene, stiffness, pushes_per_scene, kSeed);
  std::vector<Course> courses;
  courses.push_back(waitForPlane(scene, stiffness, kSeed));
  courses.push_back(pressThenPlane(scene, stiffness, kSeed));
  return courses;
}

}  // namespace

ErrorsOfSettings errorsOf(const std::vector<LawSetting>& settings, const std::vector<std::string>& scenes,
                          double distance_m, int pushes, SceneNoise noise) {
  ErrorsOfSettings errors;
  for (const LawSetting& setting : settings) errors[setting];  // one of each, however often it is named
  for (const AccuracyScene& scene : accuracyScenes()) {
    if (std::ranges::find(scenes, scene.name) == scenes.end()) continue;
    TrueScene truth = scene.at(distance_m, noise, kSeed);
    std::optional<FrameReel> reel;
    for (const Course& course : coursesOf(truth, scene.moves(), pushes)) {
      if (!reel || scene.moves()) reel.emplace(truth, noise, course.first_moving_frame);
      for (auto& [setting, error] : errors) {
        const auto box = boxFor(setting, truth.depthModel());
        follow(course, *reel, *box, takesAMean(setting) ? 0 : kSettlingFrames - 1, error);
      }
    }
  }
  return errors;
}

}  // namespace hapticd::tools
