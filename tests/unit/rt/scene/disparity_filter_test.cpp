// SPDX-License-Identifier: Apache-2.0
#include "rt/depth/disparity_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "drivers/camera/kinect_image.h"

namespace hapticd::test {
namespace {

constexpr int kRow = 240;
constexpr int kColumn = 320;

/// A filter that is given images of 640 x 480 raw values.
class FilterRig {
 public:
  explicit FilterRig(const rt::FilterParameters& filter_parameters) : parameters(filter_parameters) {}

  /// Returns the disparities after the next frame.
  const float* show(const std::function<int(int row, int column)>& raw) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        frame_->raw[row * drivers::kKinectWidth + column] = static_cast<std::uint16_t>(raw(row, column));
      }
    }
    ++frame_->sequence;
    return filter_.apply(*frame_, window, parameters);
  }
  float shown(const std::function<int(int row, int column)>& raw) {
    return show(raw)[kRow * drivers::kKinectWidth + kColumn];
  }
  float shown(int raw) {
    return shown([raw](int, int) { return raw; });
  }
  const std::uint16_t* rounded() { return filter_.rounded(window); }

  rt::FilterParameters parameters;
  rt::PixelWindow window{.column_first = 300, .column_last = 340, .row_first = 220, .row_last = 260};

 private:
  rt::DepthModel model_{rt::DepthModelParameters{}, rt::PoseParameters{}};
  rt::DisparityFilter filter_{model_};
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
};

TEST(DisparityFilter, ChangesNothingWhenItIsOff) {
  FilterRig rig({});
  EXPECT_EQ(rig.shown(700), 700);
  EXPECT_EQ(rig.shown(2047), rt::kNoDisparity);
  EXPECT_EQ(rig.shown(1085), rt::kNoDisparity);  // behind the camera
  EXPECT_EQ(rig.shown(65535), rt::kNoDisparity);
  EXPECT_EQ(rig.shown(100), rt::kNoDisparity);  // nearer than near_m
  EXPECT_EQ(rig.rounded()[kRow * drivers::kKinectWidth + kColumn], 2047);
}

TEST(DisparityFilter, AveragesStillPixelsOverTime) {
  FilterRig rig({.temporal_frames = 4});
  EXPECT_FLOAT_EQ(rig.shown(700), 700);
  EXPECT_FLOAT_EQ(rig.shown(702), 701);
  EXPECT_FLOAT_EQ(rig.shown(701), 701);
}

TEST(DisparityFilter, ReducesWhiteNoiseAsTheMeanOfAsManyFramesDoes) {
  constexpr int kFrames = 8;
  FilterRig rig({.temporal_frames = kFrames});
  std::mt19937 random(5);
  std::normal_distribution<double> noise(700, 0.6);
  double sum = 0;
  double squares = 0;
  int samples = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const float* const image =
        rig.show([&](int, int) { return static_cast<int>(std::lround(noise(random))); });
    if (frame < 20) continue;
    for (int row = 220; row <= 260; ++row) {
      for (int column = 300; column <= 340; ++column) {
        const double value = image[row * drivers::kKinectWidth + column];
        sum += value;
        squares += value * value;
        ++samples;
      }
    }
  }
  const double mean = sum / samples;
  const double deviation = std::sqrt(squares / samples - mean * mean);
  EXPECT_NEAR(mean, 700, 0.02);
  // rounded noise has sqrt(0.6^2 + 1/12) = 0.666; a running mean with weight 1/8 reduces it by sqrt(1 / (2 *
  // 8 - 1))
  EXPECT_NEAR(deviation, 0.666 / std::sqrt(15), 0.15 * 0.666 / std::sqrt(15));
}

TEST(DisparityFilter, FollowsAJumpAtOnce) {
  FilterRig rig({.temporal_frames = 8});
  for (int frame = 0; frame < 10; ++frame) rig.shown(700);
  EXPECT_FLOAT_EQ(rig.shown(710), 710);
}

TEST(DisparityFilter, LagsBehindSlowMotionByABoundedAmount) {
  FilterRig rig({.temporal_frames = 16});
  for (int frame = 0; frame < 10; ++frame) rig.shown(700);
  // 0.1 raw units per frame, 1 cm/s at 1 m, dithered over the columns as on a tilted surface
  double largest = 0;
  for (int frame = 0; frame < 120; ++frame) {
    const double truth = 700 + 0.1 * frame;
    const auto dithered = [truth](int row, int column) {
      return static_cast<int>(std::floor(truth + (row * 7 + column * 3) % 10 / 10.0));
    };
    const float* const image = rig.show(dithered);
    double mean = 0;
    for (int column = 300; column < 340; ++column)
      mean += double{image[kRow * drivers::kKinectWidth + column]} / 40;
    // the dither's mean is 0.45 above the middle of the floor function
    largest = std::max(largest, std::abs(truth - 0.05 - mean));
  }
  // sixteen frames would lag by 1.5 units; a mean difference of 0.25 shortens them to two, which takes about
  // 6 frames to detect
  EXPECT_LT(largest, 0.8);
}

TEST(DisparityFilter, HoldsAFlickeringPixelForTheConfiguredTime) {
  FilterRig rig({.hold_frames = 2});
  EXPECT_FLOAT_EQ(rig.shown(700), 700);
  EXPECT_FLOAT_EQ(rig.shown(2047), 700);
  EXPECT_FLOAT_EQ(rig.shown(2047), 700);
  EXPECT_FLOAT_EQ(rig.shown(2047), rt::kNoDisparity);
  EXPECT_FLOAT_EQ(rig.shown(705), 705);
}

TEST(DisparityFilter, SmoothsASurfaceAndKeepsItsEdges) {
  FilterRig rig({.spatial_radius_px = 2});
  const auto edge = [](int row, int column) { return column < kColumn ? 700 + (row + column) % 2 : 800; };
  const float* const image = rig.show(edge);
  EXPECT_NEAR(image[kRow * drivers::kKinectWidth + kColumn - 5], 700.5, 0.03);
  EXPECT_NEAR(image[kRow * drivers::kKinectWidth + kColumn - 1], 700.5, 0.05);
  EXPECT_FLOAT_EQ(image[kRow * drivers::kKinectWidth + kColumn], 800);
}

TEST(DisparityFilter, GivesTheSameResultForRepeatedCallsWithTheSameFrame) {
  FilterRig rig({.temporal_frames = 4, .spatial_radius_px = 1});
  rig.shown(700);
  const float once = rig.shown(702);
  EXPECT_FLOAT_EQ(once, 701);
}

}  // namespace
}  // namespace hapticd::test
