// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/scene_noise.h"

#include <vector>

#include "drivers/camera/synthetic/depth_sensor.h"

namespace hapticd::tools {

std::string_view nameOf(SceneNoise noise) {
  constexpr std::array<std::string_view, 4> kNames{"none", "quantised", "sensor", "harsh"};
  return kNames.at(static_cast<std::size_t>(noise));
}

drivers::SensorNoise::Parameters sensorParameters(SceneNoise noise) {
  return noise == SceneNoise::harsh ? drivers::SensorNoise::harsh() : drivers::SensorNoise::recorded();
}

void SceneSensor::deliver(const drivers::SceneCamera& camera, std::uint64_t frame_number, SceneNoise noise,
                          rt::DepthFrame& frame) {
  frame.sequence = frame_number;
  frame.device_ticks = 0;
  if (!isSensorNoise(noise)) {
    camera.deliverRounded(frame);
    return;
  }
  if (camera.model().law == rt::DepthLawKind::linear) {
    std::vector<float> depths_m = camera.exact();
    depth_noises_.try_emplace(noise, camera.model(), seed_, noise == SceneNoise::harsh ? 2 : 1)
        .first->second.addTo(frame_number, depths_m);
    return drivers::deliverDepths(camera.model(), depths_m, frame);
  }
  drivers::SensorNoise::Parameters parameters = sensorParameters(noise);
  if (!leaves_shadows_) parameters.shadow_side = drivers::ShadowSide::none;
  sensors_.try_emplace(noise, seed_, parameters)
      .first->second.applySensor(frame_number, camera.exact(), frame.raw);
}

}  // namespace hapticd::tools
