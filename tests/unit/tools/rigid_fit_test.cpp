// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "rt/base/pose.h"
#include "rt/depth/depth_frame.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/registration/point_files.h"
#include "tools/lib/registration/rigid_fit.h"
#include "tools/lib/registration/touch.h"

// Camera-to-world registration against poses that are known.
namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr Vec3 kPlace{0.1, -0.2, -0.9};
constexpr double kPeriod_s = 0.05;

/// A touch by a hand that is at position(t) after t seconds.
Touch touchOf(const std::function<Vec3(double)>& position) {
  Touch touch;
  for (int reading = 0; !touch.isComplete(); ++reading) touch.add(position(reading * kPeriod_s));
  return touch;
}

TEST(Touch, LastsASecond) {
  EXPECT_EQ(Touch::kReadings * Touch::kPeriod.count(), 1000);
}

TEST(Touch, OfARestingHandIsTheMeanOfAllReadings) {
  std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::normal_distribution<double> noise_m(0, 1e-4);
  Vec3 sum;
  const Touch touch = touchOf([&](double) {
    const Vec3 position = kPlace + Vec3{noise_m(random), noise_m(random), noise_m(random)};
    sum += position;
    return position;
  });
  EXPECT_TRUE(touch.isSteady()) << touch.spread_m();
  EXPECT_LT(norm(touch.mean_m_in_world() - (1.0 / Touch::kReadings) * sum), 1e-12);
}

TEST(Touch, OfAMovingHandIsNotSteady) {
  // 5 mm/s: within the few milliseconds that twenty answers take it would be 0.1 mm
  const Touch gliding = touchOf([](double t_s) { return kPlace + Vec3{0.005 * t_s, 0, 0}; });
  EXPECT_NEAR(gliding.spread_m(), 0.005 * 0.95 / 2, 1e-9);
  EXPECT_FALSE(gliding.isSteady());
  // one reading alone, 4 mm away: the mean moves by a twentieth of it
  const Touch leaping = touchOf([](double t_s) {
    return kPlace + Vec3{0, t_s > 0.49 && t_s < 0.51 ? 0.004 : 0, 0};
  });
  EXPECT_NEAR(leaping.spread_m(), 0.004 * 19 / 20, 1e-9);
  EXPECT_FALSE(leaping.isSteady());
}

using test::TemporaryFolder;

TEST(PointFiles, ReadsPairsWithCommentsEmptyLinesAndCarriageReturns) {
  const TemporaryFolder folder;
  const auto pairs = readPointPairs(folder.write(
      "pairs.csv", std::string("# by tape measure\r\n") + kPairsHeader + "\r\n\r\ncorner, 1,2,-3,4,5,6\r\n"));
  ASSERT_TRUE(pairs) << pairs.error().front().text();
  ASSERT_EQ(pairs->size(), 1U);
  EXPECT_EQ(pairs->front().name, "corner");
  EXPECT_EQ(pairs->front().camera_m, (rt::Vec3{1, 2, -3}));
  EXPECT_EQ(pairs->front().world_m, (rt::Vec3{4, 5, 6}));
}

TEST(PointFiles, TakesAHeaderAsProgramsOfTablesWriteIt) {
  const TemporaryFolder folder;
  for (const char* begin : {"\xEF\xBB\xBF", "\xEF\xBB\xBF# by tape measure\n", ""}) {
    const auto marks = readLandmarks(
        folder.write("marks.csv", std::string(begin) + "\"name\",\"column_px\", \"row_px\"\r\ncorner,1,2\n"));
    ASSERT_TRUE(marks) << marks.error().front().text();
    EXPECT_EQ(marks->size(), 1U);
  }
}

TEST(PointFiles, NamesEveryBadLine) {
  const TemporaryFolder folder;
  const auto file = folder.write("pairs.csv", std::string(kPairsHeader) +
                                                  "\na,1,2,3,4,5,x\na,1,2,3,4,5,6\n,1,2,3,4,5,6\nb,1,2\n"
                                                  "c,nan,2,3,4,5,21\n");
  const auto pairs = readPointPairs(file);
  ASSERT_FALSE(pairs);
  std::string all;
  for (const base::Error& error : pairs.error()) all += error.text() + "\n";
  for (const char* part :
       {":2: world_z_m: \"x\" is not a number (allowed: -20..20 m)", ":3: \"a\" is there twice",
        ":4: the name is missing", ":5: 3 columns where 7 are expected",
        ":6: camera_x_m: \"nan\" is out of range", ":6: world_z_m: \"21\" is out of range"}) {
    EXPECT_NE(all.find(part), std::string::npos) << part << " in\n" << all;
  }
}

TEST(PointFiles, SaysWhichHeaderIsMissing) {
  const TemporaryFolder folder;
  const auto landmarks = readLandmarks(folder.write("marks.csv", "corner,1,2\n"));
  ASSERT_FALSE(landmarks);
  EXPECT_NE(landmarks.error().front().what.find("name,column_px,row_px"), std::string::npos);
  EXPECT_FALSE(readLandmarks(folder.write("empty.csv", "")));
  EXPECT_FALSE(readLandmarks(folder.path() / "nothing"));
}

TEST(PointFiles, RefusesPixelsOutsideThePicture) {
  const TemporaryFolder folder;
  const auto landmarks = readLandmarks(
      folder.write("marks.csv", std::string(kLandmarksHeader) + "\na,1280,0\nb,0,800\nc,1279,799\n"));
  ASSERT_FALSE(landmarks);
  EXPECT_EQ(landmarks.error().size(), 2U);
}

TEST(LandmarkDepth, TakesTheMedianOfThePixelsAboutIt) {
  const rt::DepthModelParameters model;
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  // 13 of 25 pixels measure: seven the surface, six something far behind it
  for (int i = 0; i < 13; ++i) {
    const int row = 100 - 2 + i / 5;
    const int column = 200 - 2 + i % 5;
    frame[static_cast<std::size_t>(row * drivers::kKinectWidth + column)] = i < 7 ? 700 : 900;
  }
  const auto seen = positionInCamera({"mark", 200, 100}, frame, model);
  ASSERT_TRUE(seen) << seen.error().text();
  const double depth_m = 1 / (model.a_per_m * 700 + model.b_per_m);
  EXPECT_NEAR(seen->z, -depth_m, 1e-12);
  EXPECT_NEAR(seen->x, depth_m * (200 - model.cx_px) / model.fx_px, 1e-12);
  EXPECT_NEAR(seen->y, -depth_m * (100 - model.cy_px) / model.fy_px, 1e-12);
}

TEST(LandmarkDepth, RefusesAPlaceWithoutDepth) {
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, drivers::kKinectNoMeasurement);
  const auto seen = positionInCamera({"mark", 0, 0}, frame, rt::DepthModelParameters());
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().where, "mark");
  EXPECT_NE(seen.error().what.find("0 of 9 pixels"), std::string::npos) << seen.error().what;
}

TEST(LandmarkDepth, RefusesAPixelOutsideTheImageOfTheCamera) {
  std::vector<std::uint16_t> frame(drivers::kKinectPixels, 700);
  for (const Landmark& landmark : {Landmark{"mark", 640, 0}, Landmark{"mark", 0, 480}}) {
    const auto seen = positionInCamera(landmark, frame, rt::DepthModelParameters());
    ASSERT_FALSE(seen);
    EXPECT_NE(seen.error().what.find("outside the image, which has 640 x 480 pixels"), std::string::npos)
        << seen.error().what;
  }
}

TEST(PointPairs, AreRefusedInWordsThatATerminalMayShow) {
  const test::TemporaryFolder folder;
  const auto pairs =
      readPointPairs(folder.write("pairs.csv", std::string(kPairsHeader) + "\na,\x1b[2J,0,0,0,0,0\nb," +
                                                   std::string(3000, 'x') + ",0,0,0,0,0\n"));
  ASSERT_FALSE(pairs);
  ASSERT_EQ(pairs.error().size(), 2U);
  EXPECT_NE(pairs.error()[0].text().find(R"("\x1b[2J")"), std::string::npos) << pairs.error()[0].text();
  EXPECT_LT(pairs.error()[1].text().size(), 300U);
}

using rt::PoseParameters;

/// Rounding of some dozens of operations on numbers below 10.
constexpr double kRounding = 1e-12;

Vec3 moved(const PoseParameters& pose, const Vec3& p) {
  const auto r = rt::rotationOf(pose);
  return pose.position_m + Vec3{r[0] * p.x + r[1] * p.y + r[2] * p.z, r[3] * p.x + r[4] * p.y + r[5] * p.z,
                                r[6] * p.x + r[7] * p.y + r[8] * p.z};
}

class Registration : public testing::Test {
 protected:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  Vec3 point() { return {uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-1.5, -0.5)}; }
  PoseParameters pose() {
    const double pi = std::numbers::pi;
    return {{uniform(-2, 2), uniform(-2, 2), uniform(-2, 2)},
            uniform(-pi, pi),
            uniform(-pi / 2, pi / 2),
            uniform(-pi, pi)};
  }
  std::vector<PointPair> pairsOf(const PoseParameters& truth, int count) {
    std::vector<PointPair> pairs;
    for (int i = 0; i < count; ++i) {
      const Vec3 camera = point();
      pairs.push_back({std::to_string(i), camera, moved(truth, camera)});
    }
    return pairs;
  }
  std::mt19937 random_{1};
};

/// Largest difference of two rotation matrices' numbers; the angles need not agree in gimbal lock.
double difference(const PoseParameters& a, const PoseParameters& b) {
  double largest = rt::norm(a.position_m - b.position_m);
  const auto rows_a = rt::rotationOf(a);
  const auto rows_b = rt::rotationOf(b);
  for (std::size_t i = 0; i < rows_a.size(); ++i)
    largest = std::fmax(largest, std::abs(rows_a[i] - rows_b[i]));
  return largest;
}

TEST_F(Registration, FindsRandomPosesExactlyFromThreeAndMorePoints) {
  for (int trial = 0; trial < 300; ++trial) {
    const PoseParameters truth = pose();
    const auto fit = fitRigid(pairsOf(truth, 3 + trial % 5));
    if (!fit) continue;  // three random points may lie nearly on a line
    EXPECT_LT(difference(truth, fit->T_world_camera), 1e3 * kRounding);
    EXPECT_LT(fit->largest_m, 1e3 * kRounding);
    EXPECT_NEAR(truth.roll_rad, fit->T_world_camera.roll_rad, 1e-9);
    EXPECT_NEAR(truth.pitch_rad, fit->T_world_camera.pitch_rad, 1e-9);
    EXPECT_NEAR(truth.yaw_rad, fit->T_world_camera.yaw_rad, 1e-9);
  }
}

TEST_F(Registration, FindsPosesInGimbalLock) {
  for (const double pitch_rad : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
    PoseParameters truth = pose();
    truth.pitch_rad = pitch_rad;
    const auto fit = fitRigid(pairsOf(truth, 6));
    ASSERT_TRUE(fit);
    // the cosine of pi/2 in doubles is 6e-17, below what counts as locked
    EXPECT_LT(difference(truth, fit->T_world_camera), 1e-8);
  }
}

// Points of a plane are their own mirror image up to a turn; a fit that allowed reflections would take one.
TEST_F(Registration, NeverMirrors) {
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<PointPair> pairs = pairsOf(pose(), 5);
    for (PointPair& pair : pairs) pair.world_m.x = -pair.world_m.x;
    const auto fit = fitRigid(pairs);
    ASSERT_TRUE(fit);
    const auto r = rt::rotationOf(fit->T_world_camera);
    const double determinant = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                               r[2] * (r[3] * r[7] - r[4] * r[6]);
    EXPECT_NEAR(determinant, 1, 1e-9);
    EXPECT_GT(fit->largest_m, 1e-3);  // exact would be a mirror image
  }
}

TEST_F(Registration, HandlesPointsOfAPlane) {
  const PoseParameters truth = pose();
  std::vector<PointPair> pairs;
  for (const Vec3& camera : {Vec3{0, 0, -1}, {0.4, 0, -1}, {0, 0.3, -1}, {0.4, 0.3, -1}}) {
    pairs.push_back({"corner", camera, moved(truth, camera)});
  }
  const auto fit = fitRigid(pairs);
  ASSERT_TRUE(fit);
  EXPECT_LT(difference(truth, fit->T_world_camera), 1e3 * kRounding);
}

// Oracle: with noise of standard deviation s on each world coordinate of n points, the sum of squared
// residuals has 3 n - 6 degrees of freedom: the root mean square distance is s sqrt((3 n - 6) / n) on
// average.
TEST_F(Registration, LeavesAsMuchAsTheNoiseOverMany) {
  constexpr double kNoise_m = 0.002;
  constexpr int kPoints = 20;
  constexpr int kTrials = 400;
  std::normal_distribution noise(0.0, kNoise_m);
  double sum_of_squares = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<PointPair> pairs = pairsOf(pose(), kPoints);
    for (PointPair& pair : pairs) pair.world_m += Vec3{noise(random_), noise(random_), noise(random_)};
    const auto fit = fitRigid(pairs);
    ASSERT_TRUE(fit);
    sum_of_squares += fit->rms_m * fit->rms_m;
  }
  const double expected_m = kNoise_m * std::sqrt((3.0 * kPoints - 6) / kPoints);
  // chi squared with 400 * 54 degrees of freedom: its root is within 2 % by four standard deviations
  EXPECT_NEAR(std::sqrt(sum_of_squares / kTrials), expected_m, 0.02 * expected_m);
}

// Oracle: no small turn or shift of the result fits better.
TEST_F(Registration, IsTheBestOfItsNeighbourhood) {
  std::vector<PointPair> pairs = pairsOf(pose(), 8);
  for (PointPair& pair : pairs) pair.world_m += 0.02 * point();
  const auto fit = fitRigid(pairs);
  ASSERT_TRUE(fit);
  const auto costOf = [&](const PoseParameters& pose) {
    double cost = 0;
    for (const PointPair& pair : pairs)
      cost += std::pow(rt::norm(moved(pose, pair.camera_m) - pair.world_m), 2);
    return cost;
  };
  const double best = costOf(fit->T_world_camera);
  for (int trial = 0; trial < 200; ++trial) {
    PoseParameters other = fit->T_world_camera;
    other.position_m += 1e-3 * point();
    other.roll_rad += uniform(-1e-3, 1e-3);
    other.pitch_rad += uniform(-1e-3, 1e-3);
    other.yaw_rad += uniform(-1e-3, 1e-3);
    EXPECT_GE(costOf(other), best);
  }
}

TEST_F(Registration, RefusesTooFewPointsAndPointsOnALine) {
  EXPECT_NE(fitRigid(pairsOf(pose(), 2)).error().what.find("2 point pairs, at least 3"), std::string::npos);
  std::vector<PointPair> line;
  for (int i = 0; i < 5; ++i) line.push_back({"", {0.1 * i, 0, -1}, {0.1 * i, 0, -1}});
  EXPECT_NE(fitRigid(line).error().what.find("lie on a line: 0.0 mm across it"), std::string::npos);
  line.back().camera_m.y = 0.2;  // now only the world's are
  EXPECT_NE(fitRigid(line).error().what.find("the world's points lie on a line"), std::string::npos);
}

TEST_F(Registration, RefusesNumbersThatAreNotFinite) {
  std::vector<PointPair> pairs = pairsOf(pose(), 4);
  pairs[2].world_m.y = std::nan("");
  const auto fit = fitRigid(pairs);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().where, "2");
}

}  // namespace
}  // namespace hapticd::tools
