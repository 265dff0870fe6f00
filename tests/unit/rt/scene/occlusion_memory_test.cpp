// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/occlusion_memory.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::test {
namespace {

using ImageFunction = std::function<int(int row, int column)>;
using drivers::kKinectHeight;
using drivers::kKinectWidth;
using rt::OcclusionMemory;

// The oracle is arithmetic on Table I of the paper: raw = (1 / Z - b) / a.

constexpr int kNone = drivers::kKinectNoMeasurement;
constexpr int kNoneHidden = rt::kNoRawDisparity;
constexpr int kWall = 759;     // 1.000 m
constexpr int kArm = 722;      // 0.898 m
constexpr int kBox = 740;      // 0.945 m: 0.055 m in front of the wall
constexpr int kHand = 600;     // 0.672 m
constexpr int kInShell = 745;  // 0.959 m: 0.041 m in front of the wall
constexpr std::int64_t kFrame_ns = 33'333'333;

ImageFunction everywhere(int raw) {
  return [raw](int, int) { return raw; };
}

/// `raw` in the columns from `first` on, and the wall elsewhere.
ImageFunction fromColumn(int first, int raw, int width = 40) {
  return [=](int, int column) { return column >= first && column < first + width ? raw : kWall; };
}

class OcclusionMemoryOf : public EachSimdTarget {
 public:
  void show(const ImageFunction& raw, std::int64_t after_ns = kFrame_ns) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        frame_->raw[row * drivers::kKinectWidth + column] = static_cast<std::uint16_t>(raw(row, column));
      }
    }
    ++frame_->sequence;
    frame_->arrival_ns += after_ns;
    memory.update(*frame_, window);
  }
  void show(const ImageFunction& raw, int frames) {
    for (int i = 0; i < frames; ++i) show(raw);
  }
  int hiddenAt(int row, int column) const { return memory.hidden()[row * drivers::kKinectWidth + column]; }
  int hidden() const { return hiddenAt(kRow, kColumn); }
  void seeAgain(const rt::PixelWindow& other) { memory.update(*frame_, other); }

  static constexpr int kRow = 240;
  static constexpr int kColumn = 320;
  rt::PixelWindow window{.column_first = 280, .column_last = 360, .row_first = 200, .row_last = 280};
  rt::OcclusionMemory memory{rt::DepthModel({}, {})};

 private:
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
};

TEST_P(OcclusionMemoryOf, KeepsTheWallBehindAPassingArmUntilItIsSeenAgain) {
  show(everywhere(kWall), 3);
  EXPECT_FALSE(memory.hidesAnything(window));
  for (int first = 200; first < 560; first += 20) {
    show(fromColumn(first, kArm));
    for (int column = window.column_first; column <= window.column_last; ++column) {
      const bool covered = column >= first && column < first + 40;
      ASSERT_EQ(hiddenAt(kRow, column), covered ? kWall : kNoneHidden) << first << " " << column;
    }
  }
  EXPECT_FALSE(memory.hidesAnything(window));
  show(fromColumn(kColumn - 10, kArm));
  EXPECT_TRUE(memory.hidesAnything(window));
}

TEST_P(OcclusionMemoryOf, ForgetsAHiddenSurfaceWhenSomethingBehindItIsSeen) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kArm));
  ASSERT_EQ(hidden(), kWall);
  show(fromColumn(300, kWall + 40));
  EXPECT_EQ(hidden(), kNoneHidden);
}

TEST_P(OcclusionMemoryOf, DoesNotTreatSurfacesWithinTheShellAsOccluders) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kInShell));
  EXPECT_EQ(hidden(), kNoneHidden);
  show(everywhere(kWall), 3);
  show(fromColumn(300, kBox));
  EXPECT_EQ(hidden(), kWall);
}

TEST_P(OcclusionMemoryOf, KeepsTheFartherOfTwoSurfacesHiddenInSequence) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kArm), 5);
  show(fromColumn(300, kHand), 5);
  EXPECT_EQ(hidden(), kWall);
  show(fromColumn(300, kArm), 5);
  EXPECT_EQ(hidden(), kWall);
}

TEST_P(OcclusionMemoryOf, KeepsASurfaceVisibleForTwoSecondsInsteadOfTheOneBehindIt) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kArm), rt::OcclusionMemory::kSettledFrames + 1);
  ASSERT_EQ(hidden(), kWall);
  show(fromColumn(300, kHand), 5);
  EXPECT_EQ(hidden(), kArm);
  show(fromColumn(300, kArm), 1);
  EXPECT_EQ(hidden(), kNoneHidden);
}

TEST_P(OcclusionMemoryOf, OffersTheLastValueOfAFlickeringPixelForALimitedTime) {
  show(everywhere(kWall), 3);
  for (int frame = 0; frame < rt::OcclusionMemory::kHoldFrames; ++frame) {
    show(fromColumn(300, kNone));
    ASSERT_EQ(hidden(), kWall) << frame;
  }
  show(fromColumn(300, kNone));
  EXPECT_EQ(hidden(), kNoneHidden);
  EXPECT_FALSE(memory.hidesAnything(window));
  show(everywhere(kWall), 2);
  show(fromColumn(300, kNone));
  ASSERT_EQ(hidden(), kWall);
  show(fromColumn(300, kInShell));
  EXPECT_EQ(hidden(), kNoneHidden) << "the same surface, a little nearer";
}

TEST_P(OcclusionMemoryOf, KeepsSurfacesInTheShadowOfAnOccluderWhileItStays) {
  const ImageFunction arm_and_shadow = [](int, int column) {
    return column >= 300 && column < 330 ? kNone : column >= 330 && column < 400 ? kArm : kWall;
  };
  show(everywhere(kWall), 3);
  show(arm_and_shadow, 5 * rt::OcclusionMemory::kHoldFrames);
  EXPECT_EQ(hidden(), kWall);
}

TEST_P(OcclusionMemoryOf, FollowsAPlateThatMovesHalfAMetrePerSecond) {
  constexpr double kPerFrame_m = 0.5 / 30;
  for (const double direction : {-1.0, 1.0}) {
    memory.forget();
    for (int frame = 0; frame < 40; ++frame) {
      const double depth = 1.2 + direction * (frame - 20) * kPerFrame_m;
      const rt::DepthModelParameters camera;
      const int raw = static_cast<int>(std::lround((1 / depth - camera.b_per_m) / camera.a_per_m));
      show([raw](int row, int column) {  // in front of a wall at 2 m
        return std::abs(row - kRow) < 100 && std::abs(column - kColumn) < 100 ? raw : 922;
      });
      for (int column = window.column_first; column <= window.column_last; ++column) {
        ASSERT_EQ(hiddenAt(kRow, column), kNoneHidden) << direction << " " << frame;
      }
    }
  }
}

/// Number of frames in which the whole image of a Kinect is updated once.
constexpr int kStrips = 640 * 480 / rt::OcclusionMemory::kStripPixels;

TEST_P(OcclusionMemoryOf, RemembersSurfacesAwayFromTheHand) {
  show(everywhere(kWall), kStrips);
  show(fromColumn(40, kArm), 1);
  const rt::PixelWindow elsewhere{.column_first = 30, .column_last = 90, .row_first = 0, .row_last = 60};
  seeAgain(elsewhere);
  for (int row = 0; row <= 60; ++row) EXPECT_EQ(hiddenAt(row, 60), kWall) << row;
}

TEST_P(OcclusionMemoryOf, ForgetsWithinHalfASecondWhenTheCameraTurns) {
  // a slanted wall, 0.1 raw units per column, with an arm in the middle of the image; then 3 columns per
  // frame, which is 8 degrees per second
  int turned = 0;
  bool arm = false;
  const ImageFunction room = [&](int, int column) {
    const bool covered = arm && std::abs(column + turned - kColumn) < 60;
    return (covered ? 500 : 700) + (column + turned) / 10;
  };
  show(room, 20);
  arm = true;
  show(room, 20);
  ASSERT_EQ(hidden(), 732);
  int frames = 0;
  const auto remembersTheFirstPose = [&] { return hiddenAt(kRow, kColumn) == 732; };
  for (; frames < 15 && remembersTheFirstPose(); ++frames) {
    turned += 3;
    show(room);
  }
  EXPECT_LT(frames, 15);
}

TEST_P(OcclusionMemoryOf, IsNotMistakenForAMovingCameraByAPersonWhoPasses) {
  show(everywhere(kWall), 10);
  for (int first = -200; first < 640; first += 10) {
    show([first](int, int column) {
      return column >= first && column < first + 200 ? 650 + (column - first) / 10 : kWall;
    });
    const bool covered = kColumn >= first && kColumn < first + 200;
    ASSERT_EQ(hidden(), covered ? kWall : kNoneHidden) << first;
  }
}

TEST_P(OcclusionMemoryOf, ForgetsWhenFramesAreLostForHalfASecond) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kArm));
  ASSERT_TRUE(memory.hidesAnything(window));
  show(fromColumn(300, kArm), std::int64_t{500'000'001});
  EXPECT_FALSE(memory.hidesAnything(window));
  EXPECT_EQ(hidden(), kNoneHidden);
}

TEST_P(OcclusionMemoryOf, ForgetsOnRequest) {
  show(everywhere(kWall), 3);
  show(fromColumn(300, kArm));
  memory.forget();
  EXPECT_FALSE(memory.hidesAnything(window));
  show(fromColumn(300, kArm));
  EXPECT_EQ(hidden(), kNoneHidden);
}

TEST_P(OcclusionMemoryOf, HidesNothingInTheNoiseOfAStillScene) {
  // sensor noise of 0.57 raw units, the largest temporal noise measured
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.57);
  const ImageFunction room = [&](int row, int column) {
    return static_cast<int>(std::lround(700 + 0.1 * column + 0.2 * row + noise(random)));
  };
  for (int frame = 0; frame < 20; ++frame) {
    show(room);
    ASSERT_FALSE(memory.hidesAnything(window)) << frame;
  }
}

TEST_P(OcclusionMemoryOf, SortsRawValuesByDepthWhereDepthFallsWithThem) {
  const rt::DepthModelParameters falling{.a_per_m = 0.0005, .b_per_m = 0.3};  // raw 1400: 1 m; 1800: 0.83 m
  rt::OcclusionMemory other{rt::DepthModel(falling, {})};
  const auto frame = std::make_unique<rt::DepthFrame>();
  const auto seen = [&](std::uint16_t raw) {
    std::fill_n(frame->raw, drivers::kKinectPixels, raw);
    ++frame->sequence;
    other.update(*frame, window);
    return other.hidden()[kRow * drivers::kKinectWidth + kColumn];
  };
  EXPECT_EQ(seen(1400), kNoneHidden);
  EXPECT_EQ(seen(1800), 1400);
  EXPECT_EQ(seen(1400), kNoneHidden);
  EXPECT_EQ(seen(1000), kNoneHidden);
}

HAPTICD_FOR_EACH_SIMD_TARGET(OcclusionMemoryOf);

// The oracle implements OcclusionMemory's rules pixel by pixel, without vectors, tables and flags.

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
