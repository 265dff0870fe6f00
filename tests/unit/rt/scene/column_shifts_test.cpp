// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/column_shifts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "drivers/camera/kinect_image.h"

namespace hapticd::test {
namespace {

constexpr std::int64_t kFrame_ns = 33'333'333;
constexpr double kNoise_raw = 0.5;
constexpr int kBand = 116;

using Disparity = std::function<double(int row, int column)>;

/// A floor and a wall without integer disparities.
double room(int row, int column) {
  return (row < 300 ? 850 + 0.05 * column : 850 + 0.05 * column - 0.4 * (row - 300)) + 0.31;
}

/// The change that is added to the left band and subtracted from the right one.
double bands(int column) {
  return column < kBand ? 1 : column >= drivers::kKinectWidth - kBand ? -1 : 0;
}

class ColumnShiftsOf : public ::testing::Test {
 public:
  void show(const Disparity& disparity) {
    std::normal_distribution<double> noise(0, kNoise_raw);
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        frame_->raw[row * drivers::kKinectWidth + column] =
            static_cast<std::uint16_t>(std::lround(disparity(row, column) + noise(random_)));
      }
    }
    ++frame_->sequence;
    frame_->arrival_ns += kFrame_ns;
    shifts.update(*frame_);
  }
  void lose(int frames) { frame_->sequence += static_cast<std::uint64_t>(frames); }
  void pass(double seconds) { frame_->arrival_ns += static_cast<std::int64_t>(seconds * 1e9); }
  double offsetAt(int column) const { return shifts.offsets()[column / rt::BlockLattice::kBlock_px]; }
  void expectNone(const char* what) const {
    for (int column = 0; column < drivers::kKinectWidth; column += rt::BlockLattice::kBlock_px) {
      ASSERT_EQ(offsetAt(column), 0) << what << ", column " << column;
    }
  }

  rt::DepthModel model{{}, {}};
  rt::ColumnShifts shifts{model};

 private:
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
  std::mt19937 random_{1};
};

using ColumnShifts = ColumnShiftsOf;

Disparity withBands(int sign) {
  return [sign](int row, int column) { return room(row, column) + sign * bands(column); };
}

TEST_F(ColumnShifts, FindsBandsThatStepInOppositeDirections) {
  for (const int sign : {1, -1}) {
    shifts.forget();
    for (int i = 0; i < 3; ++i) show(room);
    expectNone("before the step");
    show(withBands(sign));
    for (const int column : {0, 60, kBand - 8, kBand - 4})
      EXPECT_FLOAT_EQ(static_cast<float>(offsetAt(column)), static_cast<float>(sign)) << column;
    for (const int column : {kBand + 4, 320, drivers::kKinectWidth - kBand - 8})
      EXPECT_EQ(offsetAt(column), 0) << column;
    for (const int column : {drivers::kKinectWidth - kBand + 4, 639})
      EXPECT_FLOAT_EQ(static_cast<float>(offsetAt(column)), static_cast<float>(-sign)) << column;
    for (int i = 0; i < 3; ++i) show(withBands(sign));
    EXPECT_NEAR(offsetAt(60), sign, 0.01) << "a step counts once";
  }
}

TEST_F(ColumnShifts, RevertsAStepThatTheSensorReverts) {
  for (int i = 0; i < 3; ++i) show(room);
  for (int i = 0; i < 3; ++i) show(withBands(1));
  show(room);
  EXPECT_NEAR(offsetAt(60), 0, 0.02);
  EXPECT_NEAR(offsetAt(600), 0, 0.02);
}

TEST_F(ColumnShifts, FadesWithItsTimeConstant) {
  for (int i = 0; i < 3; ++i) show(room);
  show(withBands(1));
  pass(rt::ColumnShifts::kFade_s);
  show(withBands(1));
  EXPECT_NEAR(offsetAt(60), std::exp(-1.0), 0.005);
  pass(6 * rt::ColumnShifts::kFade_s);
  show(withBands(1));
  show(withBands(1));
  expectNone("after six time constants");
}

TEST_F(ColumnShifts, DetectsTheStepNextToAMovingPerson) {
  const auto person = [](int frame, const Disparity& behind) {
    return [=](int row, int column) {
      const int left = 200 + 8 * frame;
      return column >= left && column < left + 200 ? 700 + 1.3 * frame : behind(row, column);
    };
  };
  for (int i = 0; i < 3; ++i) show(person(i, room));
  show(person(3, withBands(1)));
  EXPECT_FLOAT_EQ(static_cast<float>(offsetAt(60)), 1);
  EXPECT_FLOAT_EQ(static_cast<float>(offsetAt(600)), -1);
}

TEST_F(ColumnShifts, DoesNotMistakeMotionForAStepOfTheSensor) {
  struct Motion {
    const char* what;
    std::function<double(int row, int column)> per_frame;
  };
  const Motion motions[] = {
      {"a camera that pans", [](int, int column) { return (column - 320) / 280.0; }},
      {"a camera that pans slowly", [](int, int column) { return (column - 320) / 900.0; }},
      {"a camera that tilts", [](int row, int) { return (row - 240) / 200.0; }},
      {"a camera that comes nearer", [](int, int) { return -1.0; }},
      {"a board at the left border that comes nearer",
       [](int, int column) { return column < kBand ? -1.0 : 0.0; }},
      {"boards at both borders that come nearer",
       [](int, int column) { return std::abs(bands(column)) > 0 ? -1.0 : 0.0; }},
  };
  for (const Motion& motion : motions) {
    shifts.forget();
    for (int frame = 0; frame < 12; ++frame) {
      const int moved = std::max(0, frame - 4);
      show([&](int row, int column) { return room(row, column) + moved * motion.per_frame(row, column); });
      expectNone(motion.what);
    }
  }
}

TEST_F(ColumnShifts, ComparesNothingAfterALostFrame) {
  for (int i = 0; i < 3; ++i) show(room);
  lose(1);
  show(withBands(1));
  expectNone("after a lost frame");
  show(withBands(1));
  show(withBands(1));
  expectNone("later");
}

}  // namespace
}  // namespace hapticd::test
