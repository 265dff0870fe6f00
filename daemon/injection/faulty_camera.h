// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <random>

#include "drivers/camera/camera.h"

namespace hapticd::daemon {

class FaultInjector;

/// Wraps a camera, and drops, stops or corrupts its frames on their way to the scene thread.
class FaultyCamera final : public drivers::Camera, private drivers::FrameSink {
 public:
  FaultyCamera(std::unique_ptr<drivers::Camera> camera, const FaultInjector& faults)
      : camera_(std::move(camera)), faults_(faults) {}

  config::Result<void> start(drivers::FrameSink& sink) override;
  void stop() override { camera_->stop(); }
  drivers::CameraStatus status() const override { return camera_->status(); }

 private:
  rt::DepthFrame& back() override { return sink_->back(); }
  void publish() override;

  std::unique_ptr<drivers::Camera> camera_;
  const FaultInjector& faults_;
  drivers::FrameSink* sink_ = nullptr;
  std::uint64_t frames_ = 0;
  std::minstd_rand random_;
};

}  // namespace hapticd::daemon
