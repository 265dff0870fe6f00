// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/scene_noise.h"

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
  drivers::SensorNoise::Parameters parameters = sensorParameters(noise);
  if (!leaves_shadows_) parameters.shadow_side = drivers::ShadowSide::none;
  sensors_.try_emplace(noise, seed_, parameters)
      .first->second.applySensor(frame_number, camera.exact(), frame.raw);
}

}  // namespace hapticd::tools
