// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/focus_corner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "rt/depth/depth_model.h"
#include "rt/modelling/focus/body_fit.h"
#include "rt/modelling/focus/corner_kernel.h"
#include "rt/modelling/surface/column_shifts.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/truth/body_scene.h"

namespace hapticd {
namespace {

using rt::FaceChoice;
using rt::FocusCorner;
using rt::Vec3;

FocusCorner randomCorner(std::mt19937& random, int faces) {
  std::uniform_real_distribution<double> slope(-0.8, 0.8);
  FocusCorner corner;
  corner.faces = faces;
  for (int i = 0; i < faces; ++i) corner.face[i] = {600 + slope(random), slope(random), slope(random)};
  return corner;
}

TEST(FocusCorner, IsTheFarthestOrTheNearestOfItsPlanes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> offset_px(-40, 40);
  for (int i = 0; i < 1000; ++i) {
    FocusCorner corner = randomCorner(random, 2 + i % 2);
    corner.greatest = i % 4 < 2;
    const double du = offset_px(random);
    const double dv = offset_px(random);
    std::vector<double> disparities;
    for (int k = 0; k < corner.faces; ++k) disparities.push_back(corner.face[k].at(du, dv));
    const double expected = corner.greatest ? *std::max_element(disparities.begin(), disparities.end())
                                            : *std::min_element(disparities.begin(), disparities.end());
    EXPECT_EQ(corner.faceAt(du, dv).at(du, dv), expected);
  }
}

TEST(FocusCorner, IsTheSameSeenFromAnotherFocus) {
  std::mt19937 random(2);
  FocusCorner corner = randomCorner(random, 3);
  corner.column_px = 100;
  corner.row_px = 200;
  const FocusCorner moved = corner.movedTo(103.5, 196.25);
  for (double du = -20; du <= 20; du += 5)
    EXPECT_NEAR(moved.faceAt(du - 3.5, du + 3.75).at(du - 3.5, du + 3.75), corner.faceAt(du, du).at(du, du),
                1e-9);
}

class CornerSums : public test::EachSimdTarget {};

/// Against sums in double precision, sample by sample.
TEST_P(CornerSums, AreThoseOfEachFace) {
  constexpr double kTolerance_raw = 2.8;
  constexpr double kBeside_raw = 9;
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 2);
  const auto samples = std::make_unique<rt::FocusSamples>();
  for (const FaceChoice choice : {FaceChoice::greatest, FaceChoice::least, FaceChoice::nearest}) {
    for (int faces = 1; faces <= FocusCorner::kMaxFaces; ++faces) {
      FocusCorner corner = randomCorner(random, faces);
      corner.greatest = choice == FaceChoice::greatest;
      std::size_t count = 0;
      rt::CornerSums expected{};
      for (int cell = 0; cell < rt::FocusSamples::kCells; ++cell) {
        samples->cell_begin[cell] = count;
        for (int i = 0; i < 4 * static_cast<int>(rt::FocusSamples::kAlignment); ++i, ++count) {
          const double x = i % 8 + 8 * (cell % 3) - 12;
          const double y = i / 8 + 8 * (cell / 3) - 12;
          int met = 0;
          const double d = corner.faceAt(x, y).at(x, y) + static_cast<double>(noise(random));
          const auto isBefore = [&](int a, int b) {
            const double of_a = corner.face[a].at(x, y);
            const double of_b = corner.face[b].at(x, y);
            return choice == FaceChoice::greatest ? of_a > of_b
                   : choice == FaceChoice::least  ? of_a < of_b
                                                  : std::abs(d - of_a) < std::abs(d - of_b);
          };
          for (int k = 1; k < faces; ++k) {
            if (isBefore(k, met)) met = k;
          }
          samples->column_px[count] = static_cast<float>(x);
          samples->row_px[count] = static_cast<float>(y);
          samples->disparity_raw[count] = static_cast<float>(d);
          samples->weight[count] = i % 5 == 0 ? 0.0F : 1.0F;
          if (i % 5 == 0) continue;
          const double r = static_cast<double>(samples->disparity_raw[count]) - corner.face[met].at(x, y);
          const double near = std::max(0.0, 1 - r * r / (kTolerance_raw * kTolerance_raw));
          const double w = near * near;
          rt::FaceSums& s = expected.face[met];
          s.w += w, s.wx += w * x, s.wy += w * y, s.wxx += w * x * x, s.wxy += w * x * y, s.wyy += w * y * y;
          s.wr += w * r, s.wrx += w * r * x, s.wry += w * r * y;
          expected.fit.weight += w;
          expected.fit.square += w * r * r;
          expected.fit.explained += std::abs(r) < kTolerance_raw ? 1 : 0;
          expected.fit.unexplained += std::abs(r) >= kTolerance_raw && std::abs(r) < kBeside_raw ? 1 : 0;
          expected.fit.cell_weight[cell] += w;
          expected.fit.cell_residual[cell] += w * r;
        }
      }
      samples->cell_begin[rt::FocusSamples::kCells] = count;
      const rt::CornerSums sums = rt::cornerSumsOf(*samples, corner, choice, kTolerance_raw, kBeside_raw);
      // Single precision at a disparity of 600: 6e-5 raw per sample.
      constexpr double kRounding_raw = 1e-4;
      const double all = expected.fit.weight * kRounding_raw;
      for (int k = 0; k < FocusCorner::kMaxFaces; ++k) {
        EXPECT_NEAR(sums.face[k].w, expected.face[k].w, all);
        EXPECT_NEAR(sums.face[k].wxy, expected.face[k].wxy, 144 * all);
        EXPECT_NEAR(sums.face[k].wyy, expected.face[k].wyy, 144 * all);
        EXPECT_NEAR(sums.face[k].wr, expected.face[k].wr, 3 * all);
        EXPECT_NEAR(sums.face[k].wrx, expected.face[k].wrx, 36 * all);
        EXPECT_NEAR(sums.face[k].wry, expected.face[k].wry, 36 * all);
      }
      EXPECT_NEAR(sums.fit.square, expected.fit.square, 10 * all);
      EXPECT_NEAR(sums.fit.explained, expected.fit.explained, 1);
      EXPECT_NEAR(sums.fit.unexplained, expected.fit.unexplained, 1);
      EXPECT_NEAR(sums.fit.cell_residual[4], expected.fit.cell_residual[4], 3 * all);
    }
  }
}
HAPTICD_FOR_EACH_SIMD_TARGET(CornerSums);

/// A scene that a box would see, and what BodyFit makes of it around a focus.
class SeenScene {
 public:
  SeenScene(const std::vector<tools::TrueBody>& bodies, const tools::RigidFrame& T_camera_bodies,
            std::uint32_t seed)
      : scene_(bodies, T_camera_bodies, {}, rt::DepthModelParameters{}, seed),
        model_(scene_.depthModel(), {}),
        shifts_(model_),
        fit_(std::make_unique<rt::BodyFit>(model_, shifts_.offsets())) {
    const auto image = std::make_unique<rt::DepthFrame>();
    for (std::uint64_t frame = 1; frame <= 6; ++frame) {
      scene_.render(0, frame, tools::SceneNoise::sensor, *image);
      const rt::Facet facet{static_cast<float>(trueRaw(0, 0)), 0, 0, 0};
      body_ = fit_->fit({.image = image->raw,
                         .pixels = model_.wholeDisparity(),
                         .focus = focus_,
                         .facet = facet,
                         .noise = 1,
                         .moved_raw = 0,
                         .max_frames = 8});
    }
  }

  const FocusCorner& corner() const { return fit_->corner(); }
  double trueRaw(double du, double dv) const {
    return model_.disparity().rawOf(scene_.trueDepth(focus_.u + du, focus_.v + dv, 0));
  }
  /// RMS difference from the truth, raw units, within `reach_px` of the focus.
  double error_raw(int reach_px) const {
    double square = 0;
    int count = 0;
    for (int du = -reach_px; du <= reach_px; du += 2) {
      for (int dv = -reach_px; dv <= reach_px; dv += 2) {
        const double off = corner().faceAt(du, dv).at(du, dv) - trueRaw(du, dv);
        square += off * off;
        ++count;
      }
    }
    return std::sqrt(square / count);
  }

 private:
  tools::BodyScene scene_;
  rt::DepthModel model_;
  rt::ColumnShifts shifts_;
  std::unique_ptr<rt::BodyFit> fit_;
  rt::ImagePosition focus_{rt::DepthModelParameters{}.cx_px + 2.3, rt::DepthModelParameters{}.cy_px - 3.4};
  rt::FocusBody body_;
};

/// Faces through the middle of the image whose normals lean by `lean_rad` from the view, evenly around it.
std::vector<tools::Face> facesAround(int faces, double lean_rad, double turn_rad, bool hollow) {
  std::vector<tools::Face> result;
  for (int i = 0; i < faces; ++i) {
    const double angle = turn_rad + 2 * std::numbers::pi * i / faces;
    const double sideways = (hollow ? -1 : 1) * std::sin(lean_rad);
    result.push_back({{sideways * std::cos(angle), sideways * std::sin(angle), std::cos(lean_rad)}, 0});
  }
  return result;
}

tools::TrueBody bodyOf(const std::vector<tools::Face>& faces, bool hollow) {
  if (hollow) return tools::HollowBody{faces};
  return tools::ConvexBody{faces};
}

/// The error of a plane at the border of the part of a disc that shows it, by least squares with one sample
/// of the noise per patch: the standard deviation times sqrt(6 / patches) for halves and thirds of a disc.
TEST(CornerFit, FindsRandomCornersAsExactlyAsTheNoiseAllows) {
  constexpr double kNoise_raw = 0.56;
  constexpr int kReach_px = 8;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kCorners = 60;
  int found = 0;
  double ratios = 0;
  for (int i = 0; i < kCorners; ++i) {
    const int faces = 2 + i % 2;
    const bool hollow = i % 4 >= 2;
    const double lean_rad = (25 + 35 * uniform(random)) * std::numbers::pi / 180;
    tools::RigidFrame frame;
    frame.origin_m = {0, 0, -(0.6 + 0.6 * uniform(random))};
    const SeenScene seen({bodyOf(facesAround(faces, lean_rad, 6.28 * uniform(random), hollow), hollow)},
                         frame, static_cast<std::uint32_t>(100 + i));
    const FocusCorner& corner = seen.corner();
    if (corner.faces != faces) continue;
    ++found;
    EXPECT_EQ(corner.greatest, !hollow);
    const double patches = std::numbers::pi * corner.radius_px * corner.radius_px / (81.0 * faces);
    const double bound_raw = kNoise_raw * std::sqrt(6 / patches);
    ratios += std::pow(seen.error_raw(kReach_px) / bound_raw, 2);
  }
  EXPECT_GE(found, kCorners * 95 / 100);
  EXPECT_LE(std::sqrt(ratios / found), 1.5);
}

TEST(CornerFit, FindsNoneOnPlanesBallsAndRods) {
  const tools::ConvexBody wall{{tools::Face{{0, 0, 1}, -0.12}}};
  std::uint32_t seed = 500;
  int corners = 0;
  int scenes = 0;
  for (const double distance_m : {0.6, 0.8, 1.0}) {
    tools::RigidFrame frame;
    frame.origin_m = {0, 0, -distance_m};
    const std::vector<std::vector<tools::TrueBody>> all = {{tools::ConvexBody{{tools::Face{{0, 0, 1}, 0}}}},
                                                           {tools::BallBody{0.02}, wall},
                                                           {tools::BallBody{0.05}, wall},
                                                           {tools::BallBody{0.1}, wall},
                                                           {tools::RodBody{0.01, 1}, wall},
                                                           {tools::RodBody{0.02, 1}, wall},
                                                           {tools::RodBody{0.04, 1}, wall}};
    for (const auto& bodies : all) {
      for (int i = 0; i < 2; ++i) {
        const SeenScene seen(bodies, frame, seed++);
        ++scenes;
        if (seen.corner().faces > 0) ++corners;
      }
    }
  }
  EXPECT_EQ(corners, 0) << "of " << scenes;
}

/// In any direction, and touched beside the middle, where the limb is in the window.
TEST(CornerFit, FindsNoneOnRandomRodsBeforeAWall) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int kRods = 60;
  int corners = 0;
  for (int i = 0; i < kRods; ++i) {
    const double radius_m = 0.01 + 0.03 * uniform(random);
    const double turn_rad = 6.28 * uniform(random);
    const double tilt_rad = 0.6 * (uniform(random) - 0.5);
    const double beside_m = 1.4 * (uniform(random) - 0.5) * radius_m;
    tools::RigidFrame frame;
    frame.x = {std::cos(turn_rad) * std::cos(tilt_rad), std::sin(turn_rad) * std::cos(tilt_rad),
               std::sin(tilt_rad)};
    frame.y = {-std::sin(turn_rad), std::cos(turn_rad), 0};
    frame.z = cross(frame.x, frame.y);
    frame.origin_m = Vec3{0, 0, -(0.6 + 0.4 * uniform(random))} + beside_m * frame.y;
    const tools::ConvexBody wall{{tools::Face{frame.directionIn({0, 0, 1}), -0.12}}};
    const SeenScene seen({tools::RodBody{radius_m, 2}, wall}, frame, static_cast<std::uint32_t>(700 + i));
    if (seen.corner().faces > 0) ++corners;
  }
  EXPECT_EQ(corners, 0);
}

}  // namespace
}  // namespace hapticd
