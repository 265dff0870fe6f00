// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/modelling/surface/surface_builder.h"
#include "rt/scene/scene.h"
#include "rt/scene/visible_surface.h"

namespace hapticd {
namespace {

using DepthOn = std::function<double(double, double)>;
using rt::SurfaceView;
using rt::Vec3;

/// A surface given by its inverse depth on the ray (x, y, -1), and the visible surface of its image. The
/// camera's raw unit is 0.1 mm at 1 m, so that rounding is negligible.
class Built {
 public:
  explicit Built(const std::function<double(double, double)>& inverse_depth)
      : model_(camera(), {}),
        builder_(model_),
        storage_({1, 1, 1, 1}, 1, model_),
        frame_(std::make_unique<rt::DepthFrame>()) {
    storage_.attachTo(scene_);
    draw(inverse_depth);
  }
  void draw(const std::function<double(double, double)>& inverse_depth) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        const rt::DepthModelParameters& c = model_.parameters();
        const double w = inverse_depth((column - c.cx_px) / c.fx_px, -(row - c.cy_px) / c.fy_px);
        const double raw = (w - c.b_per_m) / c.a_per_m;
        frame_->raw[row * drivers::kKinectWidth + column] = w > 0 && raw >= 0 && raw < 2046
                                                                ? static_cast<std::uint16_t>(std::lround(raw))
                                                                : drivers::kKinectNoMeasurement;
      }
    }
  }

  static rt::DepthModelParameters camera() {
    rt::DepthModelParameters model;
    model.a_per_m = -0.0002;
    model.b_per_m = 1.2;
    model.near_m = 0.84;
    model.far_m = 1.25;
    return model;
  }

  void build(const Vec3& centre, const rt::SurfaceParameters& parameters = {}) {
    ++frame_->sequence;
    frame_->arrival_ns += 33'333'333;
    again(centre, parameters);
  }
  void again(const Vec3& centre, const rt::SurfaceParameters& parameters = {}) {
    builder_.build(*frame_, nullptr, centre, 0.06, parameters, scene_.surface);
  }
  void shift(int raw) {
    for (std::uint16_t& value : frame_->image()) {
      if (value < drivers::kKinectNoMeasurement) value = static_cast<std::uint16_t>(value + raw);
    }
  }
  void punch(int row, int column, int edge) {
    for (int r = row; r < row + edge; ++r) {
      for (int c = column; c < column + edge; ++c)
        frame_->raw[r * drivers::kKinectWidth + c] = drivers::kKinectNoMeasurement;
    }
  }

  SurfaceView view(double age_s = 0) const { return {scene_.surface, model_, 0.035, age_s}; }

 private:
  rt::DepthModel model_;
  rt::SurfaceBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
  std::unique_ptr<rt::DepthFrame> frame_;
};

/// Half a raw unit of rounding at 1 m.
constexpr double kRounding_m = 1e-4;

double degrees(double value) {
  return value * std::numbers::pi / 180;
}

TEST(VisibleSurface, GivesTheDistanceFromTiltedPlanes) {
  for (const double tilt : {0.0, 30.0, 60.0}) {
    const Vec3 normal{0, -std::sin(degrees(tilt)), std::cos(degrees(tilt))};
    Built plane([&](double x, double y) { return -dot(normal, Vec3{x, y, -1}) / normal.z; });
    plane.build({0, 0, -1});
    for (double across = -0.02; across <= 0.02; across += 0.0073) {
      for (double along = -0.02; along <= 0.02; along += 0.0061) {
        const Vec3 p = Vec3{across, along, -1 + 0.4 * across};
        const double expected = dot(normal, p - Vec3{0, 0, -1});
        const SurfaceView::Place place = plane.view().sample(p);
        ASSERT_TRUE(place.sheet.exists);
        EXPECT_NEAR(place.distance_m, expected, kRounding_m) << tilt;
        EXPECT_LE(norm(place.sheet.normal_in_camera - normal), 0.01) << tilt;
      }
    }
  }
}

TEST(VisibleSurface, GivesTheDistanceFromASphere) {
  constexpr double kRadius_m = 0.05;
  const Vec3 centre{0, 0, -1.05};
  Built sphere([&](double x, double y) {
    const Vec3 ray{x, y, -1};
    const double b = dot(ray, centre);
    const double root = b * b - dot(ray, ray) * (dot(centre, centre) - kRadius_m * kRadius_m);
    return root > 0 ? dot(ray, ray) / (b - std::sqrt(root)) : 0;
  });
  sphere.build({0, 0, -1});
  double squares = 0;
  int places = 0;
  for (double angle = 0; angle < 6.2; angle += 0.7) {
    for (const double polar : {0.1, 0.3, 0.5}) {
      const Vec3 normal{std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle),
                        std::cos(polar)};
      const SurfaceView::Place place = sphere.view().sample(centre + kRadius_m * normal);
      ASSERT_TRUE(place.sheet.exists);
      squares += place.distance_m * place.distance_m;
      ++places;
      EXPECT_LE(norm(place.sheet.normal_in_camera - normal), 0.07) << angle << " " << polar;
    }
  }
  // the just noticeable difference at 4 N is 0.28 N, at 500 N/m
  EXPECT_LE(std::sqrt(squares / places), 0.56e-3);
}

TEST(VisibleSurface, EndsWhereTheImageOfTheBodyEnds) {
  Built wall([](double x, double) { return x < 0.0205 ? 1.0 : 0.0; });
  wall.build({0, 0, -1});
  const double pitch_m = 1 / Built::camera().fx_px;
  for (double y = -0.03; y < 0.03; y += 0.0017) {
    EXPECT_EQ(wall.view().sample({0.0205 - pitch_m, y, -1.01}).where, SurfaceView::Where::inside);
    EXPECT_EQ(wall.view().sample({0.0205 + pitch_m, y, -1.01}).where, SurfaceView::Where::free);
  }
}

TEST(VisibleSurface, ClosesHolesInASurface) {
  Built wall([](double, double) { return 1.0; });
  wall.punch(235, 330, 15);  // 2.5 cm
  wall.build({0, 0, -1});
  EXPECT_NEAR(wall.view().sample({0, 0, -1.01}).distance_m, -0.01, kRounding_m);
}

TEST(VisibleSurface, IsSolidOnlyWithinTheShell) {
  Built wall([](double, double) { return 1.0; });
  wall.build({0, 0, -1});
  EXPECT_EQ(wall.view().sample({0, 0, -1.034}).where, SurfaceView::Where::inside);
  EXPECT_EQ(wall.view().sample({0, 0, -1.036}).where, SurfaceView::Where::unseen);
  EXPECT_EQ(wall.view().sample({0, 0, -0.9}).where, SurfaceView::Where::free);
}

TEST(VisibleSurface, OfASceneAtRestIsAveragedOverFrames) {
  Built wall([](double, double) { return 1.0; });
  const rt::SurfaceParameters parameters{.fusion_frames = 4};
  wall.build({0, 0, -1}, parameters);
  wall.shift(1);
  wall.build({0, 0, -1}, parameters);
  const double half_m = 0.5 * 0.0002;
  EXPECT_NEAR(wall.view().sample({0, 0, -1}).distance_m, half_m, half_m / 2);
  wall.again({0.01, 0, -1}, parameters);  // another place in the same frame does not count twice
  EXPECT_NEAR(wall.view().sample({0, 0, -1}).distance_m, half_m, half_m / 2);
}

TEST(VisibleSurface, ContinuesToMoveBetweenFrames) {
  Built wall([](double, double) { return 1.0; });
  for (int frame = 0; frame < 6; ++frame) {
    wall.shift(-20);  // 4 mm towards the camera
    wall.build({0, 0, -1 + 0.004 * (frame + 1)});
  }
  const double now_m = wall.view().sample({0, 0, -0.97}).distance_m;
  const double later_m = wall.view(1.0 / 60).sample({0, 0, -0.97}).distance_m;
  EXPECT_NEAR(now_m, 1 / 1.024 - 0.97, 5e-4);
  EXPECT_NEAR(later_m - now_m, -0.002, 3e-4);
}

TEST(VisibleSurface, ContinuesToTurnAboutAnAxisInItsMiddle) {
  // 0.25 raw units a frame at 10 px from the axis: the mean over the region is 0.
  constexpr double kPerColumn_raw = 0.025;
  constexpr double kA_per_m = -0.0002;
  const rt::DepthModelParameters camera = Built::camera();
  const double per_frame = kA_per_m * kPerColumn_raw * camera.fx_px;  // of 1/Z, at x = 1
  Built wall([](double, double) { return 1.0; });
  double turned = 0;
  const auto show = [&](int frames, double by) {
    for (int frame = 0; frame < frames; ++frame) {
      turned += by;
      wall.draw([&](double x, double) { return 1 + turned * x; });
      wall.build({0, 0, -1});
    }
  };
  const auto error_m = [&](double x, double age_s, double at_w) {
    return wall.view(age_s).sample({x * 0.97, 0, -0.97}).sheet.depth_m() - 1 / at_w;
  };
  show(10, 0);
  show(12, per_frame);
  for (const double x : {-0.05, -0.02, 0.02, 0.05}) {
    // The means lag by no more than rounding once the motion is known, and neither do the facets in between.
    EXPECT_NEAR(error_m(x, 0, 1 + turned * x), 0, kRounding_m) << x;
    EXPECT_NEAR(error_m(x, 1.0 / 60, 1 + (turned + 0.5 * per_frame) * x), 0, kRounding_m) << x;
  }
  show(6, 0);
  for (const double x : {-0.05, -0.02, 0.02, 0.05})
    EXPECT_NEAR(error_m(x, 0, 1 + turned * x), 0, kRounding_m);
}

TEST(VisibleSurfaceView, GivesTheSpeedOfTheSurfaceAlongItsNormal) {
  const double tilt = 0.5;
  Built built([tilt](double x, double) { return 1.0 - tilt * x; });
  constexpr int kPerFrame_raw = -10;
  const double approach = 10 * 0.0002 * 30;  // of 1/Z, per metre and second
  const Vec3 centre{0.01, 0.01, -1.0};
  for (int frame = 0; frame < 12; ++frame) {
    built.build(centre);
    built.shift(kPerFrame_raw);
  }
  const Vec3 p{0.01, 0.01, -0.98};
  constexpr double kLater_s = 0.001;
  const rt::SurfaceView now = built.view(0);
  const rt::SurfaceView later = built.view(kLater_s);
  const double moved_m = now.sample(p).distance_m - later.sample(p).distance_m;
  const double speed = now.sample(p).sheet.speed_m_per_s;
  EXPECT_NEAR(speed, moved_m / kLater_s, 0.002);
  EXPECT_NEAR(speed, approach * std::cos(std::atan(tilt)), 0.05 * approach);
}

/// Depth along the ray (x, y, -1), or 0 if there is nothing.

/// Returns white noise smoothed over the matching window of 9 x 9 pixels, with standard deviation 1.
std::vector<double> smoothedNoise(std::uint32_t seed) {
  constexpr int kWindow = 9;
  constexpr int kWidth = drivers::kKinectWidth + kWindow;
  constexpr int kHeight = drivers::kKinectHeight + kWindow;
  std::mt19937 random(seed);
  // Sums of uniform distributions, identical with every standard library; their variance is 1/12.
  std::vector<double> white(static_cast<std::size_t>(kWidth) * kHeight);
  for (double& value : white) value = static_cast<double>(random()) * 0x1p-32 - 0.5;
  std::vector<double> rows(white.size());
  for (std::size_t i = 0; i + kWindow <= white.size(); ++i) {
    for (std::size_t k = 0; k < kWindow; ++k) rows[i] += white[i + k];
  }
  std::vector<double> noise(drivers::kKinectPixels);
  for (std::size_t row = 0; row < drivers::kKinectHeight; ++row) {
    for (std::size_t column = 0; column < drivers::kKinectWidth; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < kWindow; ++k) sum += rows[(row + k) * kWidth + column];
      noise[row * drivers::kKinectWidth + column] = sum * std::sqrt(12.0) / kWindow;
    }
  }
  return noise;
}

/// A scene as seen by a camera.
class Seen {
 public:
  explicit Seen(const rt::DepthModelParameters& camera)
      : model_(camera, {}),
        builder_(model_),
        storage_({1, 1, 1, 1}, 1, model_),
        frame_(std::make_unique<rt::DepthFrame>()) {
    storage_.attachTo(scene_);
  }

  void show(const DepthOn& depth_on, const Vec3& centre, double noise_raw = 0, std::uint32_t seed = 1) {
    const rt::DepthModelParameters& c = model_.parameters();
    const std::vector<double> noise =
        noise_raw > 0 ? smoothedNoise(seed) : std::vector<double>(drivers::kKinectPixels);
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        const auto pixel =
            static_cast<std::size_t>(row) * drivers::kKinectWidth + static_cast<std::size_t>(column);
        const double z = depth_on((column - c.cx_px) / c.fx_px, -(row - c.cy_px) / c.fy_px);
        const double raw = z > 0 ? (1 / z - c.b_per_m) / c.a_per_m + noise_raw * noise[pixel] : -1;
        frame_->raw[pixel] = raw >= 0 && raw < 2046 ? static_cast<std::uint16_t>(std::lround(raw))
                                                    : drivers::kKinectNoMeasurement;
      }
    }
    builder_.forget();
    ++frame_->sequence;
    builder_.build(*frame_, nullptr, centre, 0.06, {}, scene_.surface);
  }

  /// Returns the surface on the ray through `p`.
  rt::Sheet sheetAt(const Vec3& p) const {
    const SurfaceView view(scene_.surface, model_, 0.035, 0);
    return view.sheetNear(view.project(p), SurfaceView::depthOf(p));
  }

 private:
  rt::DepthModel model_;
  rt::SurfaceBuilder builder_;
  rt::SceneStorage storage_;
  rt::Scene scene_;
  std::unique_ptr<rt::DepthFrame> frame_;
};

/// A sphere, or a rod along x, whose front is at the middle of the image, 1 m away.
struct Round {
  double radius_m;
  bool rod = false;

  Vec3 centre() const { return {0, 0, -1 - radius_m}; }
  Vec3 across(const Vec3& v) const { return rod ? Vec3{0, v.y, v.z} : v; }
  double depthOn(double x, double y) const {
    const Vec3 ray = across({x, y, -1});
    const double along = dot(ray, centre());
    const double root = along * along - dot(ray, ray) * (dot(centre(), centre()) - radius_m * radius_m);
    return root > 0 ? (along - std::sqrt(root)) / dot(ray, ray) : 0;
  }
  DepthOn depth() const {
    return [*this](double x, double y) { return depthOn(x, y); };
  }
};

/// Errors over places of a surface.
struct Errors {
  double place_squares = 0;  // along the normal, m^2
  double tilt_squares = 0;   // in both directions, rad^2
  double max_tilt = 0;
  int places = 0;

  void add(const rt::Sheet& sheet, const Vec3& p, const Vec3& normal) {
    ASSERT_TRUE(sheet.exists);
    const double place = SurfaceView::distanceFrom(sheet, p);
    const double tilt = norm(sheet.normal_in_camera - normal);
    place_squares += place * place;
    tilt_squares += tilt * tilt;
    max_tilt = std::max(max_tilt, tilt);
    ++places;
  }
  double place_m() const { return std::sqrt(place_squares / places); }
  double tilt() const { return std::sqrt(tilt_squares / places); }
};

/// Adds places all over the front, up to this angle from the middle.
void addErrors(const Seen& seen, const Round& body, double widest_rad, Errors& errors) {
  for (double turn = 0; turn < 2 * std::numbers::pi; turn += 0.37) {
    for (double polar = 0.05; polar <= widest_rad; polar += 0.08) {
      const Vec3 from_middle{std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), 0};
      Vec3 normal{from_middle.x, from_middle.y, std::cos(polar)};
      if (body.rod) normal = {0, std::sin(polar) * (turn < 3 ? 1 : -1), std::cos(polar)};
      Vec3 p = body.centre() + body.radius_m * normal;
      if (body.rod) p.x = 0.03 * std::cos(turn);
      errors.add(seen.sheetAt(p), p, normal);
    }
  }
}

/// Returns the largest angle: as far from the middle as strokes over spheres reach, 40 degrees, but no nearer
/// to the limb than one and a half blocks; a block there and the next one show only the body.
double widest_rad(const Round& body) {
  constexpr double kFromLimb_m = 0.01;
  return std::min(0.7, std::asin(1 - kFromLimb_m / body.radius_m));
}

/// At a force of 4 N, 0.2 N along the surface.
constexpr double kMaxTilt = 0.05;

rt::DepthModelParameters fineCamera() {
  rt::DepthModelParameters camera;  // 0.1 mm per unit at 1 m
  camera.a_per_m = -0.0001;
  camera.b_per_m = 1.1;
  camera.near_m = 0.91;
  camera.far_m = 1.11;
  return camera;
}

TEST(FacetAccuracy, CurvedBodiesAreAccurateWithoutNoise) {
  Seen seen(fineCamera());
  for (const Round& body : {Round{0.05}, Round{0.025}, Round{0.04, true}, Round{0.02, true}}) {
    seen.show(body.depth(), {0, 0, -1});
    Errors errors;
    addErrors(seen, body, widest_rad(body), errors);
    EXPECT_LE(errors.max_tilt, kMaxTilt) << body.radius_m << " " << body.rod;
    // 0.1 N at 500 N/m, a third of the just noticeable difference at 4 N
    EXPECT_LE(errors.place_m(), 0.2e-3) << body.radius_m << " " << body.rod;
  }
}

/// Two faces at 45 degrees to the view that meet in a ridge or a groove, `turn_rad` from upright and
/// `offset_m` beside the middle of the image.
struct Crease {
  bool groove;
  double turn_rad;
  double offset_m;

  double sign() const { return groove ? -1 : 1; }
  Vec3 across() const { return {std::cos(turn_rad), std::sin(turn_rad), 0}; }
  Vec3 along() const { return {-std::sin(turn_rad), std::cos(turn_rad), 0}; }
  DepthOn depth() const {
    return [*this](double x, double y) {
      const double s = dot(across(), {x, y, 0});
      const double left = (1 + offset_m) / (1 + s);
      const double right = (1 - offset_m) / (1 - s);
      return groove ? std::min(left, right) : std::max(left, right);
    };
  }
  void addErrors(const Seen& seen, double beside_m, Errors& errors) const {
    const Vec3 face = (beside_m < 0 ? -sign() : sign()) * across();
    for (double at = -0.03; at <= 0.03; at += 0.0017) {
      Vec3 p = (offset_m + beside_m) * across() + at * along();
      p.z = -1 - sign() * std::abs(beside_m);
      errors.add(seen.sheetAt(p), p, std::sqrt(0.5) * (face + Vec3{0, 0, 1}));
    }
  }
};

TEST(FacetAccuracy, CreasesStaySharpWithoutNoise) {
  Seen seen(fineCamera());
  for (const bool groove : {false, true}) {
    for (const double turn_rad : {0.03, 0.8, 1.6}) {
      for (const double offset_m : {0.0, 0.0017, 0.0034, 0.0051}) {  // a block is 6.7 mm
        const Crease crease{groove, turn_rad, offset_m};
        seen.show(crease.depth(), {0, 0, -1});
        Errors errors;
        for (const double beside_m : {-0.02, -0.01, -0.003, 0.003, 0.01, 0.02}) {
          crease.addErrors(seen, beside_m, errors);
        }
        EXPECT_LE(errors.max_tilt, kMaxTilt) << groove << " " << turn_rad << " " << offset_m;
        EXPECT_LE(errors.place_m(), 0.2e-3) << groove << " " << turn_rad << " " << offset_m;
      }
    }
  }
}

/// Standard deviation of a Kinect's noise pattern in raw units.
constexpr double kPattern_raw = 0.5;
/// The places on a body share most of their noise, so one frame is hardly more than one sample.
constexpr std::uint32_t kSeeds = 40;

/// Allowed error relative to the smallest error of an unbiased estimate of the middle of a patch, computed by
/// generalised least squares with the noise's covariance for a Kinect at 1 m.
constexpr double kMaxByFloor = 1.3;
/// Up to this angle from the middle of the body, the patch is still on it.
constexpr double kOnPatch_rad = 0.4;

TEST(FacetAccuracy, NoiseOfCurvedBodiesIsNearTheFloor) {
  struct Case {
    Round body;
    // Of a quadratic: on spheres over 0.8 radii, at most 40 mm, and on rods over 0.8 diameters.
    double floor_m;
  };
  Seen seen(rt::DepthModelParameters{});
  for (const Case& one : {Case{{0.05}, 0.80e-3}, Case{{0.025}, 1.19e-3}, Case{{0.04, true}, 0.80e-3},
                          Case{{0.02, true}, 0.92e-3}}) {
    Errors errors;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      seen.show(one.body.depth(), {0, 0, -1}, kPattern_raw, seed);
      addErrors(seen, one.body, kOnPatch_rad, errors);
    }
    EXPECT_LE(errors.place_m(), kMaxByFloor * one.floor_m) << one.body.radius_m << " " << one.body.rod;
  }
}

/// Smallest errors of position and tilt of a plane of 40 mm.
constexpr double kPlaneFloor_m = 0.45e-3;
constexpr double kTiltFloor = 0.029;

TEST(FacetAccuracy, NoiseOfPlanesIsBelowTheFloor) {
  Seen seen(rt::DepthModelParameters{});
  Errors errors;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    seen.show([](double, double) { return 1.0; }, {0, 0, -1}, kPattern_raw, seed);
    for (double x = -0.04; x < 0.04; x += 0.0071) {
      for (double y = -0.04; y < 0.04; y += 0.0067)
        errors.add(seen.sheetAt({x, y, -1}), {x, y, -1}, {0, 0, 1});
    }
  }
  EXPECT_LE(errors.place_m(), kPlaneFloor_m);
  EXPECT_LE(errors.tilt(), kTiltFloor);
}

/// At the border of a patch a plane is known half as well as in its middle; a face at its edge must not be
/// worse.
TEST(FacetAccuracy, AnEdgeUsesItsFace) {
  constexpr double kEdge_m = 0.0107;
  Seen seen(rt::DepthModelParameters{});
  Errors errors;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    seen.show([](double x, double) { return x < kEdge_m ? 1.0 : 1.12; }, {0, 0, -1}, kPattern_raw, seed);
    for (double y = -0.04; y < 0.04; y += 0.0013) {
      const Vec3 p{kEdge_m - 0.004, y, -1};
      errors.add(seen.sheetAt(p), p, {0, 0, 1});
    }
  }
  EXPECT_LE(errors.place_m(), 2 * kPlaneFloor_m);
}

}  // namespace
}  // namespace hapticd
