// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/depth_sensor.h"

#include <vector>

#include "drivers/camera/synthetic/depth_delivery.h"

namespace hapticd::drivers {

DepthSensor::DepthSensor(const rt::DepthModelParameters& camera, std::uint32_t seed,
                         const Parameters& parameters)
    : camera_(camera),
      seed_(seed),
      edges_(camera, parameters.baseline_m, seed),
      noise_(camera, seed, parameters.noise_scale) {}

void DepthSensor::dither(std::uint64_t frame_number, std::span<const float> exact_m,
                         rt::DepthFrame& frame) const {
  deliverDithered(camera_, seed_, frame_number, exact_m, frame);
}

void DepthSensor::applySensor(std::uint64_t frame_number, std::span<const float> exact_m,
                              rt::DepthFrame& frame) const {
  std::vector<float> depths_m(exact_m.begin(), exact_m.end());
  edges_.applyTo(depths_m);
  noise_.addTo(frame_number, depths_m);
  deliverDepths(camera_, depths_m, frame);
}

}  // namespace hapticd::drivers
