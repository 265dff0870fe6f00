// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/box/box_frames.h"

#include <array>
#include <cmath>
#include <string_view>

#include "rt/base/pose.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools::ros {
namespace {

constexpr std::size_t kNumbers = 6;  // of a pose: x, y, z, roll, pitch, yaw
constexpr std::array<std::string_view, kNumbers> kHandle{"handle.position_x_m", "handle.position_y_m",
                                                         "handle.position_z_m", "handle.roll_rad",
                                                         "handle.pitch_rad",    "handle.yaw_rad"};
constexpr std::array<std::string_view, kNumbers> kCamera{
    "calibration.cameraPose.xM",      "calibration.cameraPose.yM",       "calibration.cameraPose.zM",
    "calibration.cameraPose.rollRad", "calibration.cameraPose.pitchRad", "calibration.cameraPose.yawRad"};

void addFrame(std::vector<FixedFrame>& frames, const std::string& prefix, const char* name,
              const std::array<double, kNumbers>& numbers) {
  for (const double number : numbers) {
    if (!std::isfinite(number)) return;
  }
  const auto& [x, y, z, roll, pitch, yaw] = numbers;
  const rt::PoseParameters pose{{x, y, z}, roll, pitch, yaw};
  frames.push_back(
      {prefix + "world", prefix + name, {pose.position_m, rt::quaternionOf(rt::rotationOf(pose))}});
}

}  // namespace

Json handleFrameParameters() {
  return {{"names", kHandle}};
}

std::vector<FixedFrame> fixedFrames(const Json& calibration, const Json& parameters,
                                    const std::string& prefix) {
  std::array<double, kNumbers> camera;
  for (std::size_t i = 0; i < kNumbers; ++i) camera[i] = numberAt(calibration, kCamera[i]);
  std::array<double, kNumbers> handle;
  handle.fill(std::nan(""));
  for (const Json& row : listAt(parameters, "parameters")) {
    const std::string name = textAt(row, "name");
    for (std::size_t i = 0; i < kNumbers; ++i) {
      if (name == kHandle[i]) handle[i] = numberAt(row, "value");
    }
  }
  std::vector<FixedFrame> frames;
  addFrame(frames, prefix, "camera", camera);
  // half a turn about x: from y up and looking along -z to y down and looking along z
  if (!frames.empty())
    frames.push_back({prefix + "camera", prefix + "camera_optical", {{}, rt::Quaternion{1, 0, 0, 0}}});
  addFrame(frames, prefix, "handle", handle);
  return frames;
}

}  // namespace hapticd::tools::ros
