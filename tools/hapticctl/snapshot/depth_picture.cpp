// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/depth_picture.h"

#include <png.h>

#include <cmath>

#include "rt/depth_model.h"
#include "tools/hapticctl/snapshot/depth_scale.h"

namespace hapticd::tools {
namespace {

constexpr int kCrossReach_px = 8;

void drawCross(std::vector<Rgb>& picture, const rt::DepthModelParameters& camera, int column, int row) {
  const auto dot = [&](int u, int v) {
    if (u < 0 || u >= camera.width_px || v < 0 || v >= camera.height_px) return;
    picture[static_cast<std::size_t>(v * camera.width_px + u)] = kHipColour;
  };
  for (int reach = -kCrossReach_px; reach <= kCrossReach_px; ++reach) {
    dot(column + reach, row);
    dot(column, row + reach);
  }
}

void markHip(std::vector<Rgb>& picture, const Snapshot& snapshot, const rt::DepthModel& model) {
  if (!rt::isFinite(snapshot.hip_m_in_world)) return;
  const rt::Vec3 hip_in_camera = model.positionInCamera(snapshot.hip_m_in_world);
  if (hip_in_camera.z >= 0) return;  // behind the camera, which looks along -z
  const rt::DepthModelParameters& m = snapshot.depth_model;
  const double column = m.cx_px - m.fx_px * hip_in_camera.x / hip_in_camera.z;
  const double row = m.cy_px + m.fy_px * hip_in_camera.y / hip_in_camera.z;
  // far outside the picture the numbers would not fit into pixels
  if (std::abs(column) > 2 * rt::kMaxFrameWidth || std::abs(row) > 2 * rt::kMaxFrameWidth) return;
  drawCross(picture, m, static_cast<int>(std::lround(column)), static_cast<int>(std::lround(row)));
}

std::vector<Rgb> sideBySide(const std::vector<Rgb>& picture, std::ptrdiff_t width,
                            const std::vector<Rgb>& scale) {
  std::vector<Rgb> both;
  both.reserve(picture.size() + scale.size());
  for (std::ptrdiff_t row = 0; row < std::ssize(picture) / width; ++row) {
    both.insert(both.end(), picture.begin() + row * width, picture.begin() + (row + 1) * width);
    both.insert(both.end(), scale.begin() + row * kScaleWidth, scale.begin() + (row + 1) * kScaleWidth);
  }
  return both;
}

}  // namespace

std::vector<Rgb> depthPicture(const Snapshot& snapshot) {
  const rt::DepthModel model(snapshot.depth_model, snapshot.T_world_camera);
  const DepthRange range = contrastRange(snapshot);
  std::vector<Rgb> picture(snapshot.raw.size(), kNoDepthColour);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const std::uint16_t raw = snapshot.raw[i];
    if (model.depth_m(raw) <= 0) continue;
    picture[i] = colourOfDepth(model.depth_m(raw), range.near_m, range.far_m);
  }
  markHip(picture, snapshot, model);
  return picture;
}

config::Result<std::string> pngOf(const Snapshot& snapshot) {
  static_assert(sizeof(Rgb) == 3, "rows are handed to libpng as they are");
  const std::vector<Rgb> picture =
      sideBySide(depthPicture(snapshot), snapshot.depth_model.width_px,
                 depthScale(contrastRange(snapshot), snapshot.depth_model.height_px));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(snapshot.depth_model.width_px) + kScaleWidth;
  image.height = static_cast<png_uint_32>(snapshot.depth_model.height_px);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string file(bytes, '\0');
  if (!png_image_write_to_memory(&image, file.data(), &bytes, 0, picture.data(), 0, nullptr)) {
    return std::unexpected(config::Error{"png", image.message, "free memory and try again"});
  }
  file.resize(bytes);
  return file;
}

}  // namespace hapticd::tools
