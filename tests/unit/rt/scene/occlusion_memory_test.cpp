// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/occlusion_memory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "tests/unit/rt/simd_targets.h"

// The oracle is arithmetic on Table I of the paper: raw = (1 / Z - b) / a.
namespace hapticd::test {
namespace {

constexpr int kNone = drivers::kKinectNoMeasurement;
constexpr int kNoneHidden = rt::kNoRawDisparity;
constexpr int kWall = 759;     // 1.000 m
constexpr int kArm = 722;      // 0.898 m
constexpr int kBox = 740;      // 0.945 m: 0.055 m in front of the wall
constexpr int kHand = 600;     // 0.672 m
constexpr int kInShell = 745;  // 0.959 m: 0.041 m in front of the wall
constexpr std::int64_t kFrame_ns = 33'333'333;

using Image = std::function<int(int row, int column)>;

Image everywhere(int raw) {
  return [raw](int, int) { return raw; };
}

/// `raw` in the columns from `first` on, and the wall elsewhere.
Image fromColumn(int first, int raw, int width = 40) {
  return [=](int, int column) { return column >= first && column < first + width ? raw : kWall; };
}

class OcclusionMemoryOf : public EachSimdTarget {
 public:
  void show(const Image& raw, std::int64_t after_ns = kFrame_ns) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        frame_->raw[row * drivers::kKinectWidth + column] = static_cast<std::uint16_t>(raw(row, column));
      }
    }
    ++frame_->sequence;
    frame_->arrival_ns += after_ns;
    memory.update(*frame_, window);
  }
  void show(const Image& raw, int frames) {
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
  const Image arm_and_shadow = [](int, int column) {
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
  const Image room = [&](int, int column) {
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
  const Image room = [&](int row, int column) {
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

}  // namespace
}  // namespace hapticd::test
