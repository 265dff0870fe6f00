// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::tools {

enum class SceneNoise : std::uint8_t {
  none,       ///< rounded to the camera's unit; the camera of fineDepthModel() makes that next to nothing
  quantised,  ///< rounded to the camera's unit
  sensor,     ///< SensorNoise::recorded(): the noise of the resting room 03_raw11_room_static
  harsh,      ///< SensorNoise::harsh(): two other devices, whose pattern hardly changes between frames
};
inline constexpr std::array kAllNoises{SceneNoise::none, SceneNoise::quantised, SceneNoise::sensor,
                                       SceneNoise::harsh};
std::string_view nameOf(SceneNoise noise);

/// The noise of a real sensor, not only rounding.
constexpr bool isSensorNoise(SceneNoise noise) {
  return noise > SceneNoise::quantised;
}
/// harsh() for `harsh`, else recorded().
drivers::SensorNoise::Parameters sensorParameters(SceneNoise noise);

/// A depth camera for scenes with known depths: adds rounding or noise, and applies its limits.
/// Thread: one at a time.  RT: not safe.
class SceneCamera {
 public:
  /// `seed`: of the noise. `leaves_shadows`: the noise leaves out what the projector does not reach.
  SceneCamera(const rt::DepthModelParameters& model, std::uint32_t seed, bool leaves_shadows = true);

  const rt::DepthModelParameters& model() const noexcept { return model_; }

  /// The ray through a point of the image, at depth 1: x right, y up, -z ahead.
  rt::Vec3 rayThrough(double column, double row) const noexcept;

  /// The disparity of a depth, not rounded; drivers::kNothingSeen where nothing is measured.
  float exactDisparity(double depth_m) const;

  /// Takes `depthOf(ray)`, metres, for each pixel; infinite where the ray meets nothing.
  template <typename DepthOf>
  void measure(const DepthOf& depthOf) {
    float* exact = exact_.data();
    for (int row = 0; row < rt::kFrameHeight; ++row) {
      for (int column = 0; column < rt::kFrameWidth; ++column) {
        *exact++ = exactDisparity(depthOf(rayThrough(column, row)));
      }
    }
  }
  /// The disparities that were taken, row by row.
  std::vector<float>& exact() noexcept { return exact_; }

  /// Writes the taken disparities as raw values of frame `frame_number` (from 1 on), which chooses the noise.
  void deliver(std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame);
  /// Noise may carry a raw value beyond near_m..far_m: the camera measures nothing there.
  void removeOutsideLimits(rt::DepthFrame& frame) const;

 private:
  rt::DepthModelParameters model_;
  std::uint32_t seed_;
  bool leaves_shadows_;
  std::map<SceneNoise, drivers::SensorNoise> sensors_;  // each is made when it is first needed
  std::vector<float> exact_;
  std::array<bool, rt::kRawValues> within_limits_{};
};

}  // namespace hapticd::tools
