// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "tools/lib/client/reply_reader.h"

namespace hapticd::tools {

/// A depth frame, the parameters of the camera that took it, and where HIP and proxy were at that time.
struct Snapshot {
  std::int64_t frame = 0;          ///< number of the frame
  std::vector<std::uint16_t> raw;  ///< raw values of the whole image, row by row without gaps
  rt::DepthModelParameters depth_model;
  rt::PoseParameters T_world_camera;
  rt::Vec3 hip_m_in_world;
  rt::Vec3 proxy_m_in_world;
};

/// Assembles a frame from the replies of GetSnapshot.
/// Errors: what the replies lack, or what does not fit a Kinect's frame.
class SnapshotAssembler {
 public:
  base::Result<void> add(const Json& reply);
  /// The number of rows received so far, of depth_model.height_px.
  int rows() const noexcept { return rows_; }
  base::Result<Snapshot> finish();

 private:
  base::Result<void> addHeader(const Json& header);

  Snapshot snapshot_;
  bool has_header_ = false;
  int rows_ = 0;
};

/// A binary little-endian PLY file of all pixels with a depth, as points in the world: float x, y, z in
/// metres, uchar red, green, blue. The colour shows the depth; points within `radius_m` of the HIP are
/// marked. Proxy and HIP are the last two points, if they are known.
std::string plyOf(const Snapshot& snapshot, double radius_m);

}  // namespace hapticd::tools
