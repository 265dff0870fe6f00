// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/snapshot/snapshot.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string_view>

#include "config/base/base64.h"
#include "rt/depth/depth_model.h"

namespace hapticd::tools {
namespace {

constexpr std::array<Rgb, 9> kViridis{{{68, 1, 84},
                                       {71, 44, 122},
                                       {59, 81, 139},
                                       {44, 113, 142},
                                       {33, 144, 141},
                                       {39, 173, 129},
                                       {92, 200, 99},
                                       {170, 220, 50},
                                       {253, 231, 37}}};

std::uint8_t between(std::uint8_t low, std::uint8_t high, double share) {
  return static_cast<std::uint8_t>(std::lround(low + share * (high - low)));
}

}  // namespace

Rgb colourOfDepth(double depth_m, double near_m, double far_m) {
  const double nearness = std::clamp((far_m - depth_m) / (far_m - near_m), 0.0, 1.0);
  const double place = nearness * static_cast<double>(kViridis.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double share = place - static_cast<double>(below);
  const Rgb& low = kViridis[below];
  const Rgb& high = kViridis[below + 1];
  return {between(low.red, high.red, share), between(low.green, high.green, share),
          between(low.blue, high.blue, share)};
}

namespace {

constexpr double kMinSpan_m = 0.05;
constexpr double kLowPercentile = 0.01;

constexpr Rgb kPaper{255, 255, 255};
constexpr Rgb kInk{0, 0, 0};
// Sizes of the strip in pixels.
constexpr int kMargin = 16;
constexpr int kBarLeft = 10;
constexpr int kBarWidth = 20;
constexpr int kTickLength = 6;
constexpr int kTextLeft = kBarLeft + kBarWidth + kTickLength + 4;
constexpr int kMinTicks = 5;

constexpr int kGlyphWidth = 5;
constexpr int kGlyphHeight = 7;
constexpr int kEnlarged = 2;

/// A character of the scale: each number is a row of five pixels, the highest bit at the left.
struct Glyph {
  char character;
  std::array<unsigned, kGlyphHeight> rows;
};
constexpr std::array<Glyph, 12> kGlyphs{{{'0', {14, 17, 19, 21, 25, 17, 14}},
                                         {'1', {4, 12, 4, 4, 4, 4, 14}},
                                         {'2', {14, 17, 1, 2, 4, 8, 31}},
                                         {'3', {31, 2, 4, 2, 1, 17, 14}},
                                         {'4', {2, 6, 10, 18, 31, 2, 2}},
                                         {'5', {31, 16, 30, 1, 1, 17, 14}},
                                         {'6', {6, 8, 16, 30, 17, 17, 14}},
                                         {'7', {31, 1, 2, 4, 8, 8, 8}},
                                         {'8', {14, 17, 17, 14, 17, 17, 14}},
                                         {'9', {14, 17, 17, 15, 1, 2, 12}},
                                         {'.', {0, 0, 0, 0, 0, 12, 12}},
                                         {'m', {0, 0, 26, 21, 21, 21, 21}}}};

/// Colours, row by row.
class Strip {
 public:
  explicit Strip(int height)
      : height_(height),
        pixels_(static_cast<std::size_t>(kScaleWidth) * static_cast<std::size_t>(height), kPaper) {}

  void dot(int column, int row, Rgb colour) {
    if (column < 0 || column >= kScaleWidth || row < 0 || row >= height_) return;
    pixels_[static_cast<std::size_t>(row * kScaleWidth + column)] = colour;
  }

  void line(int left, int width, int row, Rgb colour) {
    for (int column = left; column < left + width; ++column) dot(column, row, colour);
  }

  void text(std::string_view text, int left, int top) {
    for (const char character : text) {
      const auto glyph = std::ranges::find(kGlyphs, character, &Glyph::character);
      if (glyph != kGlyphs.end()) draw(*glyph, left, top);
      left += (kGlyphWidth + 1) * kEnlarged;
    }
  }

  std::vector<Rgb> pixels() && { return std::move(pixels_); }

 private:
  void draw(const Glyph& glyph, int left, int top) {
    for (int y = 0; y < kGlyphHeight * kEnlarged; ++y) {
      const unsigned row = glyph.rows[static_cast<std::size_t>(y / kEnlarged)];
      for (int x = 0; x < kGlyphWidth * kEnlarged; ++x) {
        if ((row >> static_cast<unsigned>(kGlyphWidth - 1 - x / kEnlarged) & 1U) != 0) {
          dot(left + x, top + y, kInk);
        }
      }
    }
  }

  int height_;
  std::vector<Rgb> pixels_;
};

/// The largest of 1, 2, 5 times a power of ten that leaves enough ticks in the range.
double tickStep_m(const DepthRange& range) {
  const double most = (range.far_m - range.near_m) / kMinTicks;
  double step = 0.01;  // labels have two digits behind the point
  for (double power = 0.01; power <= most; power *= 10) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor * power <= most) step = factor * power;
    }
  }
  return step;
}

}  // namespace

DepthRange contrastRange(const Snapshot& snapshot) {
  const rt::DepthModel model(snapshot.depth_model, snapshot.T_world_camera);
  std::vector<double> depths_m;
  for (const std::uint16_t raw : snapshot.raw) {
    if (model.depth_m(raw) > 0) depths_m.push_back(model.depth_m(raw));
  }
  if (depths_m.empty()) return {snapshot.depth_model.near_m, snapshot.depth_model.far_m};
  std::ranges::sort(depths_m);
  const auto low = static_cast<std::size_t>(kLowPercentile * static_cast<double>(depths_m.size() - 1));
  DepthRange range{depths_m[low], depths_m[depths_m.size() - 1 - low]};
  if (const double missing_m = kMinSpan_m - (range.far_m - range.near_m); missing_m > 0) {
    range.near_m -= missing_m / 2;
    range.far_m += missing_m / 2;
  }
  return range;
}

std::vector<Rgb> depthScale(const DepthRange& range, int height) {
  Strip strip(height);
  const int bottom = height - kMargin;
  const auto rowOf = [&](double depth_m) {
    const double share = (depth_m - range.near_m) / (range.far_m - range.near_m);
    return kMargin + static_cast<int>(std::lround(share * (bottom - kMargin)));
  };
  for (int row = kMargin; row <= bottom; ++row) {
    const double share = static_cast<double>(row - kMargin) / (bottom - kMargin);
    const double depth_m = range.near_m + share * (range.far_m - range.near_m);
    strip.line(kBarLeft, kBarWidth, row, colourOfDepth(depth_m, range.near_m, range.far_m));
  }
  const double step_m = tickStep_m(range);
  constexpr double kRounding_m = 1e-9;  // so that a tick at an end of the range is not lost
  const double first = std::ceil((range.near_m - kRounding_m) / step_m);
  for (double number = first; number * step_m <= range.far_m + kRounding_m; ++number) {
    const int row = rowOf(number * step_m);
    strip.line(kBarLeft + kBarWidth, kTickLength, row, kInk);
    strip.text(fmt::format("{:.2f}", number * step_m) + "m", kTextLeft, row - kGlyphHeight * kEnlarged / 2);
  }
  return std::move(strip).pixels();
}

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

base::Result<std::string> pngOf(const Snapshot& snapshot) {
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
    return std::unexpected(base::Error{"png", image.message, "free memory and try again"});
  }
  file.resize(bytes);
  return file;
}

namespace {

using base::Error;
using base::Result;

Error unfitting(const std::string& what) {
  return {"snapshot", what, "is hapticd of another version than hapticctl? See 'hapticctl version'"};
}

rt::Vec3 vectorAt(const Json& json, const std::string& path) {
  return {numberAt(json, path + ".x"), numberAt(json, path + ".y"), numberAt(json, path + ".z")};
}

/// Returns a whole number from 0 to 65536, or 0 if there is none.
double wholeAt(const Json& json, const std::string& path) {
  const double number = numberAt(json, path);
  return number >= 0 && number <= 65536 ? std::floor(number) : 0;
}

rt::DepthModelParameters depthModelAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("depthModel.") + name); };
  rt::DepthModelParameters camera{.a_per_m = at("aPerM"),
                                  .b_per_m = at("bPerM"),
                                  .fx_px = at("fxPx"),
                                  .fy_px = at("fyPx"),
                                  .cx_px = at("cxPx"),
                                  .cy_px = at("cyPx"),
                                  .near_m = at("nearM"),
                                  .far_m = at("farM"),
                                  .width_px = static_cast<int>(wholeAt(header, "width")),
                                  .height_px = static_cast<int>(wholeAt(header, "height"))};
  if (textAt(header, "depthModel.law") != rt::wordOf(rt::DepthLawKind::linear)) return camera;
  camera.law = rt::DepthLawKind::linear;
  camera.unit_m = at("unitM");
  camera.raw_no_measurement = static_cast<std::uint16_t>(wholeAt(header, "depthModel.rawNoMeasurement"));
  camera.raw_values = static_cast<std::uint32_t>(wholeAt(header, "depthModel.rawValues"));
  return camera;
}

rt::PoseParameters poseAt(const Json& header) {
  const auto at = [&](const char* name) { return numberAt(header, std::string("cameraPose.") + name); };
  return {{at("xM"), at("yM"), at("zM")}, at("rollRad"), at("pitchRad"), at("yawRad")};
}

bool isFinite(const rt::PoseParameters& pose) {
  return rt::isFinite(pose.position_m) && std::isfinite(pose.roll_rad + pose.pitch_rad + pose.yaw_rad);
}

}  // namespace

Result<void> SnapshotAssembler::addHeader(const Json& header) {
  const double frame = numberAt(header, "frame");
  snapshot_.frame = std::isnan(frame) ? 0 : static_cast<std::int64_t>(frame);
  snapshot_.depth_model = depthModelAt(header);
  snapshot_.T_world_camera = poseAt(header);
  // null if the core knows none: the mark is not drawn then
  snapshot_.hip_m_in_world = vectorAt(header, "tick.hipMInWorld");
  snapshot_.proxy_m_in_world = vectorAt(header, "tick.proxyMInWorld");
  const rt::DepthModelParameters& camera = snapshot_.depth_model;
  if (const rt::CameraFault fault = rt::faultOf(camera); fault == rt::CameraFault::size) {
    return std::unexpected(
        unfitting(fmt::format("a frame of {}x{} pixels, at most {}x{} expected", countAt(header, "width"),
                              countAt(header, "height"), rt::kMaxFrameWidth, rt::kMaxFrameHeight)));
  } else if (fault != rt::CameraFault::none || !isFinite(snapshot_.T_world_camera)) {
    return std::unexpected(unfitting("the depth model or the camera's pose is missing or wrong"));
  }
  snapshot_.raw.assign(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px),
                       camera.raw_no_measurement);
  has_header_ = true;
  return {};
}

Result<void> SnapshotAssembler::add(const Json& reply) {
  const Json* header = fieldAt(reply, "header");
  if (header && header->is_object()) {
    if (auto good = addHeader(*header); !good) return good;
  }
  if (!has_header_) return std::unexpected(unfitting("the first reply has no header"));
  if (numberAt(reply, "firstRow") != rows_) {
    return std::unexpected(
        unfitting(fmt::format("row {} where {} is due", countAt(reply, "firstRow"), rows_)));
  }
  const Json* rows = fieldAt(reply, "rows");
  const auto bytes =
      rows && rows->is_string() ? base::base64Decoded(rows->get_ref<const std::string&>()) : std::nullopt;
  const auto width = static_cast<std::size_t>(snapshot_.depth_model.width_px);
  const std::size_t row_bytes = 2 * width;
  if (!bytes || bytes->size() % row_bytes != 0) return std::unexpected(unfitting("incomplete rows"));
  const int count = static_cast<int>(bytes->size() / row_bytes);
  if (rows_ + count > snapshot_.depth_model.height_px)
    return std::unexpected(unfitting("more rows than a frame has"));
  const std::size_t first = static_cast<std::size_t>(rows_) * width;
  for (std::size_t i = 0; 2 * i < bytes->size(); ++i) {
    const auto low = static_cast<unsigned char>((*bytes)[2 * i]);
    const auto high = static_cast<unsigned char>((*bytes)[2 * i + 1]);
    snapshot_.raw[first + i] = static_cast<std::uint16_t>(low | (high << 8));
  }
  rows_ += count;
  return {};
}

Result<Snapshot> SnapshotAssembler::finish() {
  if (const int height = snapshot_.depth_model.height_px; rows_ != height) {
    return std::unexpected(unfitting(fmt::format("{} rows where a frame has {}", rows_, height)));
  }
  return std::move(snapshot_);
}

namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as the machine stores numbers");

class Vertices {
 public:
  void add(const rt::Vec3& p_m_in_world, const Rgb& colour) {
    for (const double coordinate : {p_m_in_world.x, p_m_in_world.y, p_m_in_world.z}) {
      const auto number = static_cast<float>(coordinate);
      char bytes[sizeof number];
      std::memcpy(bytes, &number, sizeof number);
      bytes_.append(bytes, sizeof bytes);
    }
    for (const std::uint8_t part : {colour.red, colour.green, colour.blue}) {
      bytes_.push_back(static_cast<char>(part));
    }
    ++count_;
  }
  std::size_t count() const { return count_; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t count_ = 0;
};

void addPixels(Vertices& vertices, const Snapshot& snapshot, double radius_m) {
  const rt::DepthModel model(snapshot.depth_model, snapshot.T_world_camera);
  for (std::uint32_t row = 0; row < static_cast<std::uint32_t>(model.height_px()); ++row) {
    for (std::uint32_t column = 0; column < static_cast<std::uint32_t>(model.width_px()); ++column) {
      const std::uint16_t raw = snapshot.raw[row * static_cast<std::uint32_t>(model.width_px()) + column];
      if (model.depth_m(raw) <= 0) continue;
      const rt::Vec3 point = model.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
      const bool near_hip = rt::norm(point - snapshot.hip_m_in_world) <= radius_m;
      vertices.add(point, near_hip ? kNeighbourColour
                                   : colourOfDepth(model.depth_m(raw), snapshot.depth_model.near_m,
                                                   snapshot.depth_model.far_m));
    }
  }
}

}  // namespace

std::string plyOf(const Snapshot& snapshot, double radius_m) {
  Vertices vertices;
  addPixels(vertices, snapshot, radius_m);
  if (rt::isFinite(snapshot.proxy_m_in_world)) vertices.add(snapshot.proxy_m_in_world, kProxyColour);
  if (rt::isFinite(snapshot.hip_m_in_world)) vertices.add(snapshot.hip_m_in_world, kHipColour);
  return fmt::format(
             "ply\nformat binary_little_endian 1.0\ncomment hapticd depth frame {}, metres in the world "
             "frame\n"
             "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
             "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
             snapshot.frame, vertices.count()) +
         vertices.bytes();
}

}  // namespace hapticd::tools
