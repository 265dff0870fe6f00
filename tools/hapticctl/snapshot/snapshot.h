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

struct Rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Rgb&) const = default;
};

inline constexpr Rgb kNoDepthColour{0, 0, 0};
inline constexpr Rgb kHipColour{255, 0, 0};
inline constexpr Rgb kProxyColour{255, 255, 255};
inline constexpr Rgb kNeighbourColour{255, 140, 0};

/// The colour of a depth, in perceptually even steps: yellow at near_m, dark violet at far_m.
/// Source: samples of the colour map viridis (van der Walt, Smith, 2015, public domain), linear in between.
Rgb colourOfDepth(double depth_m, double near_m, double far_m);

/// Depths in metres, near_m below far_m.
struct DepthRange {
  double near_m = 0;
  double far_m = 0;
};

/// The depths over which the colours of a picture are spread: from the 1st to the 99th percentile of the
/// pixels, so that neither a few near pixels nor a far wall take all the contrast; at least 5 cm. Where
/// nothing is measured, the range of the camera.
DepthRange contrastRange(const Snapshot& snapshot);

/// Columns of the strip with the scale.
inline constexpr int kScaleWidth = 112;

/// Returns a strip to be placed at the right of a picture: the colours of the range from the nearest depth on
/// top to the farthest, with round depths beside them in metres, such as "0.80m". kScaleWidth times `height`
/// colours, row by row.
std::vector<Rgb> depthScale(const DepthRange& range, int height);

/// The depth image as the camera sees it, one colour for each pixel, row by row: depth by colour, spread over
/// contrastRange(); black where there is no depth; a cross at the HIP where it is in front of the camera and
/// in the picture.
std::vector<Rgb> depthPicture(const Snapshot& snapshot);

/// A PNG file of the depth image, with the scale of its depths at the right. The image begins at the left
/// edge, so that columns and rows of the file are the pixels of the camera. Errors: no memory.
base::Result<std::string> pngOf(const Snapshot& snapshot);

/// A binary little-endian PLY file of all pixels with a depth, as points in the world: float x, y, z in
/// metres, uchar red, green, blue. The colour shows the depth; points within `radius_m` of the HIP are
/// marked. Proxy and HIP are the last two points, if they are known.
std::string plyOf(const Snapshot& snapshot, double radius_m);

}  // namespace hapticd::tools
