// SPDX-License-Identifier: Apache-2.0
#include "daemon/injection/faulty_camera.h"

#include "daemon/injection/fault_injector.h"

namespace hapticd::daemon {

config::Result<void> FaultyCamera::start(drivers::FrameSink& sink) {
  sink_ = &sink;
  return camera_->start(*this);
}

void FaultyCamera::publish() {
  ++frames_;
  if (faults_.isOn(Fault::frozen_camera)) return;
  if (faults_.isOn(Fault::lost_frames) && frames_ % 2 == 0) return;
  if (faults_.isOn(Fault::garbage_depth)) {
    // all 16 bits, although a sensor's values have 11
    for (std::uint16_t& raw : sink_->back().raw) raw = static_cast<std::uint16_t>(random_());
  }
  sink_->publish();
}

}  // namespace hapticd::daemon
