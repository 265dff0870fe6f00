// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/landmark_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace hapticd::tools {
namespace {

/// Raw values about the landmark that have a depth, and how many pixels were looked at.
std::vector<std::uint16_t> rawsAbout(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                     const rt::DepthModel& model, std::size_t& looked_at) {
  std::vector<std::uint16_t> raws;
  const int top = std::max(landmark.row_px - kLandmarkReach_px, 0);
  const int bottom = std::min(landmark.row_px + kLandmarkReach_px, model.height_px() - 1);
  const int left = std::max(landmark.column_px - kLandmarkReach_px, 0);
  const int right = std::min(landmark.column_px + kLandmarkReach_px, model.width_px() - 1);
  for (int row = top; row <= bottom; ++row) {
    for (int column = left; column <= right; ++column) {
      const std::uint16_t raw = frame[static_cast<std::size_t>(row * model.width_px() + column)];
      ++looked_at;
      if (model.depth_m(raw) > 0) raws.push_back(raw);
    }
  }
  return raws;
}

}  // namespace

base::Result<rt::Vec3> positionInCamera(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                        const rt::DepthModelParameters& parameters) {
  const rt::DepthModel model(parameters, {});  // a camera at the world's origin: world and camera frame agree
  if (landmark.column_px >= parameters.width_px || landmark.row_px >= parameters.height_px) {
    return std::unexpected(base::Error{
        landmark.name,
        fmt::format("column {}, row {} lies outside the image, which has {} x {} pixels", landmark.column_px,
                    landmark.row_px, parameters.width_px, parameters.height_px),
        "read the pixel off 'hapticctl snapshot --png' of the same camera"});
  }
  std::size_t looked_at = 0;
  std::vector<std::uint16_t> raws = rawsAbout(landmark, frame, model, looked_at);
  if (2 * raws.size() < looked_at) {
    return std::unexpected(base::Error{
        landmark.name,
        fmt::format("{} of {} pixels about column {}, row {} have a depth, at least half are needed",
                    raws.size(), looked_at, landmark.column_px, landmark.row_px),
        fmt::format("choose a place that shows in 'hapticctl snapshot --png', {}..{} m from the camera",
                    parameters.near_m, parameters.far_m)});
  }
  // raw values are monotonic in depth, so its median is that of the depths
  const auto middle = raws.begin() + static_cast<std::ptrdiff_t>(raws.size() / 2);
  std::ranges::nth_element(raws, middle);
  return model.pointInWorld(rt::PackedPixel::pack(static_cast<std::uint32_t>(landmark.column_px),
                                                  static_cast<std::uint32_t>(landmark.row_px), *middle),
                            *middle);
}

}  // namespace hapticd::tools
