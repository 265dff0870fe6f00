// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/occlusion_memory.h"
#include "tests/unit/rt/simd_targets.h"

// The oracle implements OcclusionMemory's rules pixel by pixel, without vectors, tables and flags.
namespace hapticd::test {
namespace {

using drivers::kKinectHeight;
using drivers::kKinectWidth;
using rt::OcclusionMemory;

constexpr int kUnmeasured = drivers::kKinectNoMeasurement;
constexpr int kBeyondAll_m = 10;
constexpr int kSceneNoise_raw = 2;
constexpr int kOccluderFrom_raw = 3;
constexpr int kSeenTogether = 32;  // columns that are processed together

struct PixelHistory {
  std::optional<int> visible;
  std::optional<int> hidden;
  bool is_missing = false;
  bool is_offered = false;
  int since = 0;
};

class ReferenceMemory {
 public:
  explicit ReferenceMemory(const rt::DepthModelParameters& camera)
      : camera_(camera), pixels_(drivers::kKinectPixels) {}

  void update(const rt::DepthFrame& frame, const rt::PixelWindow& window) {
    ++now_;
    const int strip_rows = OcclusionMemory::kStripPixels / drivers::kKinectWidth;
    const int strip =
        static_cast<int>(frame.sequence % (drivers::kKinectHeight / static_cast<unsigned>(strip_rows)));
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      const std::uint16_t* const raw = frame.raw + row * drivers::kKinectWidth;
      if (row / strip_rows == strip) {
        seeRow(raw, row, 0, drivers::kKinectWidth - 1);
      } else if (row >= window.row_first && row <= window.row_last) {
        seeRow(raw, row, window.column_first / kSeenTogether * kSeenTogether,
               window.column_last / kSeenTogether * kSeenTogether + kSeenTogether - 1);
      }
    }
  }
  std::optional<int> hidden(int row, int column) const { return pixels_[indexOf(row, column)].hidden; }

 private:
  static std::size_t indexOf(int row, int column) {
    return static_cast<std::size_t>(row) * drivers::kKinectWidth + static_cast<std::size_t>(column);
  }
  double depth(int raw) const {
    const double inverse = camera_.a_per_m * raw + camera_.b_per_m;
    return inverse > 1.0 / kBeyondAll_m ? 1 / inverse : kBeyondAll_m;
  }
  int fartherBy(int raw, int than) const { return camera_.a_per_m > 0 ? than - raw : raw - than; }
  bool isNearer(int raw, int than) const {
    return fartherBy(than, raw) > kOccluderFrom_raw && depth(raw) < depth(than) - OcclusionMemory::kShell_m;
  }

  void seeRow(const std::uint16_t* raw, int row, int first, int last) {
    for (int column = first; column <= last; ++column) {
      PixelHistory& pixel = pixels_[indexOf(row, column)];
      if (raw[column] < kUnmeasured) {
        measured(pixel, raw[column]);
      } else {
        missing(pixel, raw, column);
      }
    }
  }

  void measured(PixelHistory& pixel, int raw) const {
    const PixelHistory before = pixel;
    pixel.visible = raw;
    pixel.is_missing = pixel.is_offered = false;
    if (!before.visible) {
      pixel.since = now_;
    } else if (isNearer(raw, *before.visible)) {
      const bool was_settled = !before.is_missing && now_ - before.since >= OcclusionMemory::kSettledFrames;
      if (!before.hidden || was_settled) pixel.hidden = before.visible;
      pixel.since = now_;
    } else {
      if (before.is_offered) pixel.hidden.reset();
      if (isNearer(*before.visible, raw)) {
        pixel.since = now_;
      } else if (before.is_missing) {
        pixel.since = now_ - OcclusionMemory::kSettledFrames;
      }
    }
    if (pixel.hidden && fartherBy(raw, *pixel.hidden) >= -kSceneNoise_raw) pixel.hidden.reset();
  }

  void missing(PixelHistory& pixel, const std::uint16_t* raw, int column) const {
    if (!pixel.visible) return;
    if (!pixel.is_missing) {
      pixel.is_missing = true;
      pixel.since = now_;
      pixel.is_offered = !pixel.hidden;
      if (pixel.is_offered) pixel.hidden = pixel.visible;
    } else if (now_ - pixel.since >= OcclusionMemory::kHoldFrames) {
      if (isInShadow(pixel, raw, column)) {
        pixel.since = now_;
      } else {
        pixel = {};
      }
    }
  }

  bool isInShadow(const PixelHistory& pixel, const std::uint16_t* raw, int column) const {
    const auto casts = [&](int step) {
      int beside = column;
      while (beside >= 0 && beside < drivers::kKinectWidth && raw[beside] >= kUnmeasured) beside += step;
      return beside >= 0 && beside < drivers::kKinectWidth && isNearer(raw[beside], *pixel.hidden);
    };
    return pixel.hidden && (casts(-1) || casts(1));
  }

  rt::DepthModelParameters camera_;
  std::vector<PixelHistory> pixels_;
  int now_ = 0;
};

/// Frames in which ranges of rows change at random: surfaces at all distances, noise, and pixels without
/// measurement; in every 4th row only the latter, at most one range. In every 3rd row, surfaces in
/// front of or behind the wall approach it. Every 64th column is at rest, so that no camera motion is
/// detected.
class FlickeringFrames {
 public:
  explicit FlickeringFrames(int wall) : wall_(wall), scene_(drivers::kKinectPixels, wall) {}

  void next(rt::DepthFrame& frame) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      if (upTo(2) == 0) changeStretch(row);
    }
    for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
      const std::size_t row = pixel / drivers::kKinectWidth;
      int& raw = scene_[pixel];
      if (row % 3 == 0 && raw < kUnmeasured) raw += (raw < wall_) - (raw > wall_);
      frame.raw[pixel] =
          static_cast<std::uint16_t>(pixel % 64 == 0 ? wall_ : noisy(raw, row % 5 == 0 ? 3 : 1));
    }
    ++frame.sequence;
    frame.arrival_ns += 33'333'333;
  }
  int upTo(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

 private:
  int noisy(int raw, int max_change) {
    return raw < kUnmeasured ? std::clamp(raw + upTo(2 * max_change + 1) - max_change, 0, kUnmeasured - 1)
                             : raw;
  }
  void changeStretch(int row) {
    const int first = upTo(drivers::kKinectWidth);
    const int last = std::min(first + upTo(upTo(3) == 0 ? 200 : 12), drivers::kKinectWidth - 1);
    const auto begin = scene_.begin() + row * drivers::kKinectWidth;
    const bool flickers_only = row % 4 == 0;
    if (flickers_only) std::fill_n(begin, drivers::kKinectWidth, wall_);
    std::fill(begin + first, begin + last + 1, flickers_only ? kUnmeasured : anyRaw());
  }
  int anyRaw() {
    const int kind = upTo(10);
    if (kind < 3) return wall_;
    if (kind < 6) return kUnmeasured;
    if (kind == 6) return 0xF000 + upTo(0x1000);  // damaged
    if (kind == 7) return upTo(kUnmeasured);
    return std::clamp(wall_ + upTo(301) - 150, 0, kUnmeasured - 1);
  }

  int wall_;
  std::vector<int> scene_;
  std::mt19937 random_{3};
};

class OcclusionReference : public EachSimdTarget {
 protected:
  static void expectTheSame(const rt::DepthModelParameters& camera, int wall) {
    OcclusionMemory memory{rt::DepthModel(camera, {})};
    ReferenceMemory reference(camera);
    FlickeringFrames frames(wall);
    const auto frame = std::make_unique<rt::DepthFrame>();
    frame->sequence = 0xFFFF - 40;  // the memory's own frame counter wraps around
    for (int i = 0; i < 120; ++i) {
      frames.next(*frame);
      const int column = frames.upTo(drivers::kKinectWidth - 100);
      const int row = 200 + frames.upTo(60);
      const rt::PixelWindow window{.column_first = column,
                                   .column_last = column + frames.upTo(100),
                                   .row_first = row,
                                   .row_last = row + 40};
      memory.update(*frame, window);
      reference.update(*frame, window);
      ASSERT_NO_FATAL_FAILURE(compare(memory, reference, window)) << "frame " << i;
    }
  }

 private:
  static void compare(const OcclusionMemory& memory, const ReferenceMemory& reference,
                      const rt::PixelWindow& window) {
    constexpr int kTile = 64;
    const int end = (window.column_last / kTile + 1) * kTile;
    for (int row = window.row_first; row <= window.row_last; ++row) {
      for (int column = window.column_first; column <= window.column_last; ++column) {
        ASSERT_EQ(memory.hidden()[row * drivers::kKinectWidth + column],
                  reference.hidden(row, column).value_or(rt::kNoRawDisparity))
            << row << " " << column;
      }
      bool hides_beside = false;
      for (int column = window.column_first / kTile * kTile; column < end; ++column) {
        hides_beside = hides_beside || reference.hidden(row, column);
      }
      rt::PixelWindow of_row = window;
      of_row.row_first = of_row.row_last = row;
      ASSERT_EQ(memory.hidesAnything(of_row), hides_beside) << row;
    }
  }
};

TEST_P(OcclusionReference, AgreesWhereDepthRisesWithRaw) {
  expectTheSame({}, 759);
}

TEST_P(OcclusionReference, AgreesWhereDepthFallsWithRaw) {
  expectTheSame({.a_per_m = 0.0005, .b_per_m = 0.3}, 1400);
}

HAPTICD_FOR_EACH_SIMD_TARGET(OcclusionReference);

}  // namespace
}  // namespace hapticd::test
