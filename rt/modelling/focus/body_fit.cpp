// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/focus/body_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <Eigen/Dense>

#include "rt/modelling/focus/corner_kernel.h"
#include "rt/modelling/focus/outline.h"

namespace hapticd::rt {
namespace {

/// Gauss-Newton steps from an estimate that is good already, and from one that may be far off.
constexpr int kSteps = 1;
constexpr int kColdSteps = 3;
/// How far the surface may bend away within the smallest window while its curvature is unknown.
constexpr double kUnknownSag_m = 0.012;
/// Weighted square of the difference between a body and the fit to a new frame, in the noise's covariance, at
/// which it is certainly the same body. The part of the noise that changes from frame to frame makes about 1.
constexpr double kSameBody = 4;
/// The same divided by the number of patches of the noise, under a focus at rest: 1.2 raw units squared.
constexpr double kSamePlace = 4.6;
/// Largest displacement of a focus at rest from one frame to the next.
constexpr double kRest_px = 0.25;
/// What differs from the body by no more than this, besides noise, touches it: the body has another shape.
constexpr double kBeside_m = 0.02;
/// Where a body covers less of a window, the rest may be another face of a corner.
constexpr double kWholeShare = 0.94;
/// By how much a corner's loss must be less than the body's, and by which share of it: what explains little
/// more of a window that shows mostly other things is no corner.
constexpr double kLessLoss = 0.02;
constexpr double kLessLossShare = 0.125;
/// Keeps the equations regular where no pixel determines a parameter.
constexpr double kLeastInformation = 1e-9;
/// Least share of the noise's variance that is assumed, where the residuals are smaller than noise.
constexpr double kLeastNoise = 0.01;
/// Standard deviation of a pixel, raw units of a Kinect v1.
constexpr double kNoise_raw = 0.56;
/// Before anything is known, curvatures have a standard deviation of one over this.
constexpr double kUsualRadius_m = 0.01;
/// Standard deviation of the curvatures that a body's outline tells, relative to them: of all together, for
/// an elliptic section of up to 1.5 times the width or the depth, and of each of them.
constexpr double kOutlineScale = 0.3;
constexpr double kOutlineShape = 0.1;
/// How much likelier than a flat front a round one is inside of an outline, before depths tell. Taken for the
/// other, a plate feels too near and a rod too far, both by a fifth of half the width; but the rod is let go.
constexpr double kRoundOverFlat = 4;
/// A smaller share of a round body in the mean is not worth its fit.
constexpr double kLeastRound = 0.01;
/// Gauss-Newton steps, but one, from the outline's curvatures.
constexpr int kRoundSteps = 1;
/// Largest evidence of a model with one condition less than the one it is a case of, and of a plane.
constexpr double kMost = 20;
constexpr double kMostOfPlane = kMost * kMost;

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

Matrix6 matrixOf(const BodyEquations& equations) {
  Matrix6 matrix;
  int product = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column, ++product)
      matrix(row, column) = matrix(column, row) = equations.products[product];
  }
  return matrix;
}

/// Changes a body by its six parameters.
void change(FocusBody& body, const Vector6& by, double a_per_m) {
  body.inverse_depth_per_m += a_per_m * by[0];
  const Vec3 normal = body.normal + by[1] * body.tangent + by[2] * body.otherTangent();
  body.normal = (1 / norm(normal)) * normal;
  const Vec3 tangent = body.tangent - dot(body.tangent, body.normal) * body.normal;
  body.tangent = (1 / norm(tangent)) * tangent;
  body.curvature.along_1 += by[3];
  body.curvature.twist += by[4];
  body.curvature.along_2 += by[5];
  body.updateMatrix();
}

/// Moves a body along with the surface that it is of.
void carry(FocusBody& body, const DisparityMotion& moved, const DepthModel& model) {
  const DepthModelParameters& camera = model.parameters();
  const double a_per_m = model.disparity().a_per_m;
  const Vec3 ray = body.ray();
  body.inverse_depth_per_m +=
      a_per_m * moved.at(camera.cx_px + camera.fx_px * ray.x, camera.cy_px + camera.fy_px * ray.y);
  if (!moved.turns()) return;
  // The tangent plane has the inverse depth P r on the ray r; its slopes change, its value at the focus has.
  const double x = a_per_m * moved.per_column * camera.fx_px;
  const double y = a_per_m * moved.per_row * camera.fy_px;
  const Vec3 plane =
      (body.inverse_depth_per_m / dot(body.normal, ray)) * body.normal + Vec3{x, y, -x * ray.x - y * ray.y};
  body.normal = (-1 / norm(plane)) * plane;
  const Vec3 tangent = body.tangent - dot(body.tangent, body.normal) * body.normal;
  body.tangent = (1 / norm(tangent)) * tangent;
  body.updateMatrix();
}

/// What is known of the curvatures (along e1, twist, along e2) before the depths are.
struct CurvaturePrior {
  Vector3 mean = Vector3::Zero();
  Matrix3 covariance = Matrix3::Zero();
};

/// Returns what a body's outline tells of its curvatures, if it is round: those of an ellipsoid of revolution
/// or of a rod. `focal_px`: mean.
CurvaturePrior roundBody(const FocusBody& body, const BodyOutline& outline, double focal_px) {
  const Vec3 axis = cross(body.normal, cross(body.ray(), {outline.along_x, outline.along_y, 0}));
  const double length = norm(axis);
  const double c = dot(axis, body.tangent) / length;
  const double s = dot(axis, body.otherTangent()) / length;
  // A ball of radius R whose front is at the depth Z has an outline at the angle R / (Z + R).
  const double across = std::max(1.0, focal_px / outline.across_px - 1);
  const double ratio = outline.across_px / outline.along_px;
  const double along = outline.ends_share * ratio * ratio * across;
  CurvaturePrior prior;
  prior.mean = across * Vector3(s * s, -c * s, c * c) + along * Vector3(c * c, c * s, s * s);
  prior.covariance = kOutlineScale * kOutlineScale * prior.mean * prior.mean.transpose();
  const double each = kOutlineShape * across;
  prior.covariance.diagonal() += each * each * Vector3(1, 0.5, 1);
  return prior;
}

/// The mean of several models of the curvatures.
struct CurvatureModels {
  Vector3 mean;
  double weight;  ///< of all of them; of curvatures of which nothing is known before: 1
  double plane;   ///< evidence of a plane
};

/// Returns the estimate in which planes, spheres and cylinders are preferred.
/// `curvature`: along e1, twist, along e2; `covariance`: its own; `prior`: variance before anything is known.
CurvatureModels preferred(const Vector3& curvature, const Matrix3& covariance, double prior) {
  const Matrix3 information = covariance.inverse();
  Vector3 sum = curvature;
  double weight = 1;
  const auto add = [&](const Vector3& model, double evidence) {
    sum += evidence * model;
    weight += evidence;
  };
  // Plane.
  const double flat = curvature.dot(information * curvature);
  const double plane =
      std::sqrt(0.5 * prior * prior * prior / covariance.determinant()) * std::exp(-0.5 * flat);
  add(Vector3::Zero(), std::min(kMostOfPlane, plane));
  // Sphere: equal curvatures, no twist.
  const Vector3 equal(1, 0, 1);
  const double mean = equal.dot(information * curvature) / equal.dot(information * equal);
  const Vector3 off_sphere = curvature - mean * equal;
  const Eigen::Matrix<double, 2, 3> unequal{{1, 0, -1}, {0, 2, 0}};
  const Eigen::Matrix2d of_unequal = unequal * covariance * unequal.transpose();
  add(mean * equal, std::min(kMost, std::sqrt(4 * prior * prior / of_unequal.determinant()) *
                                        std::exp(-0.5 * off_sphere.dot(information * off_sphere))));
  // Cylinder: the smaller of the principal curvatures is 0.
  const double middle = 0.5 * (curvature[0] + curvature[2]);
  const double half = 0.5 * (curvature[0] - curvature[2]);
  const double distance = std::hypot(half, curvature[1]);
  if (distance > 0) {
    const double smaller = middle >= 0 ? middle - distance : middle + distance;
    const double sign = middle >= 0 ? 1 : -1;
    // d(middle -+ distance) / d(along_1, twist, along_2)
    const Vector3 gradient(0.5 - sign * 0.5 * half / distance, -sign * curvature[1] / distance,
                           0.5 + sign * 0.5 * half / distance);
    const Vector3 spread = covariance * gradient;
    const double variance = gradient.dot(spread);
    add(curvature - (smaller / variance) * spread,
        std::min(kMost, std::sqrt(prior / variance) * std::exp(-0.5 * smaller * smaller / variance)));
  }
  return {.mean = (1 / weight) * sum, .weight = weight, .plane = plane};
}

/// Returns the share of a round body inside of its outline in the mean with other models. `curvature`,
/// `covariance`, `prior`: see preferred().
double shareOfRound(const CurvaturePrior& round, double outline_share, const CurvatureModels& models,
                    const Vector3& curvature, const Matrix3& covariance, double prior) {
  const Matrix3 spread = covariance + round.covariance;
  const Vector3 off = curvature - round.mean;
  const double evidence = std::sqrt(0.5 * prior * prior * prior / spread.determinant()) *
                          std::exp(-0.5 * off.dot(spread.inverse() * off));
  // Its curvature is as little free as a plane's: what is too much of evidence for that is for this.
  const double of_plane = std::min(1.0, kMostOfPlane / models.plane);
  const double weight = outline_share * kRoundOverFlat * std::min(kMostOfPlane, of_plane * evidence);
  return weight / (weight + models.weight);
}

/// Returns by how much the parameters of another estimate of the same place differ, in the basis of `body`.
Vector6 differenceTo(const FocusBody& body, const FocusBody& other, double a_per_m) {
  const Vec3 e = body.tangent;
  const Vec3 f = body.otherTangent();
  const double along_normal = dot(other.normal, body.normal);
  Vector6 difference;
  difference << (other.inverse_depth_per_m - body.inverse_depth_per_m) / a_per_m,
      dot(other.normal, e) / along_normal, dot(other.normal, f) / along_normal,
      dot(e, other.a * e) - body.curvature.along_1, dot(e, other.a * f) - body.curvature.twist,
      dot(f, other.a * f) - body.curvature.along_2;
  return difference;
}

/// Returns 1 if the fit to a new frame is of the same body as the mean of the fits before, 0 if the frame
/// contradicts that by more than noise. `samples`: number of patches of the noise in the window. Under a
/// focus at rest it is the same body as long as the pixels differ by no more than the sensor's own drift.
double sameness(const Vector6& difference, const Matrix6& information, double samples, double moved_px) {
  const double contradiction = difference.dot(information * difference);
  const double same = fallingStep(contradiction, kSameBody, 3 * kSameBody);
  const double same_at_rest = fallingStep(contradiction / samples, kSamePlace, 2.5 * kSamePlace) *
                              fallingStep(moved_px, kRest_px, 4 * kRest_px);
  return std::max(same, same_at_rest);
}

}  // namespace

FocusBody BodyFit::startOf(const Input& input) const noexcept {
  const ImagePosition& focus = input.focus;
  const Facet& facet = input.facet;
  const DepthModelParameters& camera = model_.parameters();
  const DisparityScale& scale = model_.disparity();
  FocusBody body;
  body.column_px = focus.u;
  body.row_px = focus.v;
  body.ray_x = (focus.u - camera.cx_px) / camera.fx_px;
  body.ray_y = (focus.v - camera.cy_px) / camera.fy_px;
  body.inverse_depth_per_m = scale.inverseDepth_per_m(facet.disparity);
  const double x = scale.a_per_m * static_cast<double>(facet.per_column) * camera.fx_px;
  const double y = scale.a_per_m * static_cast<double>(facet.per_row) * camera.fy_px;
  const Vec3 plane{x, y, body.inverse_depth_per_m - x * body.ray_x - y * body.ray_y};
  body.normal = (-1 / norm(plane)) * plane;
  const Vec3 tangent = Vec3{1, 0, 0} - body.normal.x * body.normal;
  body.tangent = (1 / norm(tangent)) * tangent;
  body.curvature = {};
  body.updateMatrix();
  body.exists = body.inverse_depth_per_m > 0 && dot(body.normal, body.ray()) < 0;
  return body;
}

BodyFit::Trial BodyFit::tryWindow(const Job& job, const FocusBody& start, double area_px, std::size_t window,
                                  bool cold) noexcept {
  Trial trial{.fitted = start,
              .chosen = start,
              .agrees = 0,
              .radius_px = job.image.radius_px(window),
              .area_px = 0,
              .covers = 0,
              .loss = 1};
  const int stride = FocusImage::strideFor(trial.radius_px, area_px);
  const std::size_t seen = trial.radius_px < FocusImage::kLeastRadius_px
                               ? 0
                               : job.image.collect(trial.radius_px, stride, samples_);
  if (seen == 0) return trial;
  const double per_patch =
      FocusImage::kPatch_px * FocusImage::kPatch_px / static_cast<double>(stride * stride);
  const double variance = job.image.sigma_raw * job.image.sigma_raw * per_patch;
  BodyEquations equations{};
  Matrix6 matrix;
  Eigen::LLT<Matrix6> factors;
  const auto step = [&](FocusBody& body, const CurvaturePrior& prior, const BodyMeasure& measure) {
    equations = equationsOf(samples_, body, measure);
    matrix = matrixOf(equations);
    Vector6 residuals = Eigen::Map<const Vector6>(equations.residuals);
    matrix.diagonal().head<3>().array() += kLeastInformation;
    const Matrix3 information = variance * prior.covariance.inverse();
    matrix.bottomRightCorner<3, 3>() += information;
    const TangentCurvature& k = body.curvature;
    residuals.tail<3>() += information * (prior.mean - Vector3(k.along_1, k.twist, k.along_2));
    factors.compute(matrix);
    if (factors.info() != Eigen::Success) return false;
    change(body, factors.solve(residuals), job.measure.a_per_m);
    return true;
  };
  const CurvaturePrior unknown{.covariance = job.prior * Matrix3::Identity()};
  const int steps = cold ? kColdSteps : kSteps;
  for (int i = 0; i <= steps; ++i) {
    BodyMeasure measure = job.measure;
    if (cold) measure.tolerance_raw += std::max(0.0, 1 - 0.34 * i) * kUnknownSag_m / job.image.unit_m;
    if (!step(trial.fitted, unknown, measure)) return trial;
  }
  const FitSums& sums = equations.sums;
  const Misfit now = Misfit::of(sums, job.image.sigma_raw, per_patch);
  Window& known = windows_[window];
  const double same = known.frames > 0 ? sameness(differenceTo(trial.fitted, known.mean, job.measure.a_per_m),
                                                  matrix / variance, std::max(1.0, sums.weight / per_patch),
                                                  job.image.moved_px)
                                       : 0;
  // What changes from frame to frame decides neither the body nor how wide it is.
  known.misfit = now.mixedWith(known.misfit, std::max(job.image.newShare(), 1 - same));
  known.frames = 1 + same * std::min(known.frames, job.image.max_frames - 1);
  known.tried = true;
  const double before_share = 1 - 1 / known.frames;
  FocusBody mean = trial.fitted;
  if (before_share > 0)
    change(mean, before_share * differenceTo(mean, known.mean, job.measure.a_per_m), job.measure.a_per_m);
  known.mean = mean;
  trial.loss = sums.loss(static_cast<double>(seen), job.measure.tolerance_raw);
  trial.covers = sums.explained / static_cast<double>(seen);
  trial.area_px = std::max(sums.explained, 1.0) * stride * stride;
  if (sums.weight * stride * stride > FocusImage::kLeastPixels) trial.agrees = known.misfit.agreement();
  // What the noise leaves open.
  const double less_noise = 1 - (1 - kLeastNoise) * fallingStep(now.residual, 0.2, 0.5);
  const Matrix6 covariance = less_noise * variance * factors.solve(Matrix6::Identity());
  const Matrix3 of_curvature = covariance.block<3, 3>(3, 3);
  const TangentCurvature& k = mean.curvature;
  const Vector3 curvature(k.along_1, k.twist, k.along_2);
  const CurvatureModels models = preferred(curvature, of_curvature, job.prior);
  Vector6 by;
  by.tail<3>() = models.mean - curvature;
  by.head<3>() = covariance.block<3, 3>(0, 3) * (of_curvature.inverse() * by.tail<3>());
  trial.chosen = mean;
  change(trial.chosen, by, job.measure.a_per_m);

  const BodyOutline outline =
      BodyOutline::of(job.image, trial.fitted, job.measure, equations, stride, trial.radius_px);
  if (!(outline.share > 0)) {
    known.round.exists = false;
    return trial;
  }
  FocusBody round = trial.fitted;
  const CurvaturePrior prior =
      roundBody(round, outline, std::sqrt(job.measure.focal_x_px * job.measure.focal_y_px));
  const double share = shareOfRound(prior, outline.share, models, curvature, of_curvature, job.prior);
  if (share < kLeastRound) {
    known.round.exists = false;
    return trial;
  }
  round.curvature = {.along_1 = prior.mean[0], .twist = prior.mean[1], .along_2 = prior.mean[2]};
  round.updateMatrix();
  for (int i = 0; i <= kRoundSteps; ++i) {
    if (!step(round, prior, job.measure)) return trial;
  }
  if (known.round.exists && before_share > 0)
    change(round, before_share * differenceTo(round, known.round, job.measure.a_per_m), job.measure.a_per_m);
  known.round = round;
  change(trial.chosen, share * differenceTo(trial.chosen, round, job.measure.a_per_m), job.measure.a_per_m);
  return trial;
}

BodyFit::Job BodyFit::jobFor(const Input& input, double depth_m) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  const DisparityScale& scale = model_.disparity();
  const double sigma_raw = input.noise * kNoise_raw;
  const double tolerance_raw = FocusImage::kTolerance_sigma * sigma_raw;
  const double unit_m = scale.unit_m(depth_m);
  const double usual = depth_m / kUsualRadius_m;
  const double moved_px = std::hypot(input.focus.u - last_.column_px, input.focus.v - last_.row_px);
  const double beside_raw = tolerance_raw + kBeside_m / unit_m;
  return {.image = {.image = input.image,
                    .stride_px = model_.stride_px(),
                    .pixels = input.pixels,
                    .column_shift_raw = column_shift_raw_,
                    .column_px = input.focus.u,
                    .row_px = input.focus.v,
                    .sigma_raw = sigma_raw,
                    .tolerance_raw = tolerance_raw,
                    .beside_raw = beside_raw,
                    .unit_m = unit_m,
                    .px_per_m = camera.fx_px / depth_m,
                    .moved_px = moved_px,
                    .max_frames = input.max_frames},
          .measure = {.focal_x_px = camera.fx_px,
                      .focal_y_px = camera.fy_px,
                      .a_per_m = scale.a_per_m,
                      .b_per_m = scale.b_per_m,
                      .tolerance_raw = tolerance_raw,
                      .beside_raw = beside_raw},
          .prior = usual * usual};
}

FocusBody BodyFit::movedTo(const Input& input) const noexcept {
  const DepthModelParameters& camera = model_.parameters();
  FocusBody same = last_;
  carry(same, input.moved, model_);
  same = same.movedTo((input.focus.u - camera.cx_px) / camera.fx_px - last_.ray_x,
                      (input.focus.v - camera.cy_px) / camera.fy_px - last_.ray_y);
  same.column_px = input.focus.u;
  same.row_px = input.focus.v;
  const double depth_raw = model_.disparity().rawOf(1 / same.inverse_depth_per_m);
  const double off_raw = std::abs(depth_raw - static_cast<double>(input.facet.disparity));
  same.exists = same.exists && off_raw < FocusImage::kTolerance_sigma * input.noise * kNoise_raw;
  return same;
}

void BodyFit::moveWindows(const Input& input, bool warm) noexcept {
  const FocusBody here = startOf(input);
  for (Window& window : windows_) {
    if (!warm || !window.tried) window.frames = 0;
    window.tried = false;
    if (!(window.frames > 0)) continue;
    for (FocusBody* mean : {&window.mean, &window.round}) {
      carry(*mean, input.moved, model_);
      *mean = mean->movedTo(here.ray_x - mean->ray_x, here.ray_y - mean->ray_y);
    }
    if (!window.mean.exists) window.frames = 0;
  }
}

FocusBody BodyFit::fit(const Input& input) noexcept {
  const FocusBody cold_start = startOf(input);
  const FocusBody warm_start = movedTo(input);
  corner_ = {};
  if (input.facet.disparity < 0 || !cold_start.exists) return last_ = {};
  const bool warm = warm_start.exists;
  const FocusBody& start = warm ? warm_start : cold_start;
  moveWindows(input, warm);
  const Job job = jobFor(input, 1 / start.inverse_depth_per_m);
  std::size_t smallest = 0;
  while (smallest + 1 < kWindows && job.image.radius_px(smallest) < FocusImage::kLeastRadius_px) ++smallest;

  // From the window of the frame before down to one that agrees, and from that up as far as they agree.
  std::array<Trial, kWindows> trials;
  std::size_t top = warm ? std::max(smallest, window_) : smallest;
  const double area_px = warm ? area_px_ : FocusImage::kWholeWindow_px2;
  std::size_t base = top;
  trials[base] = tryWindow(job, start, area_px, base, !warm);
  while (trials[base].agrees < 1 && base > smallest) {
    --base;
    trials[base] = tryWindow(job, start, area_px, base, !warm);
  }
  if (trials[base].agrees < 1 && warm) {
    windows_[base].frames = 0;
    const Trial again = tryWindow(job, cold_start, FocusImage::kWholeWindow_px2, base, true);
    if (again.agrees > trials[base].agrees) {
      trials[base] = again;
      top = base;
    }
  }
  // Only where it explains more of the widest window than the body.
  const auto fitCorner = [&](std::size_t least, std::size_t first) {
    const double at_focus_raw = model_.disparity().rawOf(1 / start.inverse_depth_per_m);
    corner_ =
        corner_fit_.fit(job.image, {.least = least, .first = first}, at_focus_raw, input.moved, samples_);
    if (corner_.faces == 0) return;
    const double radius_px = job.image.radius_px(first);
    const std::size_t seen = job.image.collect(
        radius_px, FocusImage::strideFor(radius_px, FocusImage::kWholeWindow_px2), samples_);
    const double loss =
        cornerSumsOf(samples_, corner_, choiceOf(corner_), job.measure.tolerance_raw, job.measure.beside_raw)
            .fit.loss(static_cast<double>(seen), job.measure.tolerance_raw);
    const double of_body = trials[first].loss;
    if (loss <= of_body - std::max(kLessLoss, kLessLossShare * of_body)) return;
    corner_fit_.reject();
    corner_ = {};
  };
  if (!(trials[base].agrees > 0)) {
    fitCorner(smallest, base);
    return last_ = {};
  }
  while (trials[top].agrees > FocusImage::kLeastShare && top + 1 < kWindows) {
    const double growth = FocusImage::kRadius_m[top + 1] / FocusImage::kRadius_m[top];
    trials[top + 1] =
        tryWindow(job, trials[top].fitted, growth * growth * trials[top].area_px, top + 1, true);
    ++top;
  }
  // The narrowest window that the body does not explain.
  std::size_t least = base;
  while (least <= top && trials[least].agrees >= 1 && trials[least].covers >= kWholeShare) ++least;
  if (least > top)
    corner_fit_.forget();
  else
    fitCorner(least == base ? smallest : least, top);
  return combined(job, std::span(trials).subspan(base, top - base + 1), base);
}

FocusBody BodyFit::combined(const Job& job, std::span<const Trial> trials, std::size_t base) noexcept {
  const double a_per_m = job.measure.a_per_m;
  FocusBody result = trials[0].chosen;
  result.radius_px = trials[0].agrees * trials[0].radius_px;
  double share = trials[0].agrees;
  std::size_t last = 0;
  for (std::size_t i = 1; i < trials.size() && share > 0; ++i) {
    share *= trials[i].agrees;
    if (!(share > 0)) break;
    if (share > 0.5) last = i;
    change(result, share * differenceTo(result, trials[i].chosen, a_per_m), a_per_m);
    result.radius_px += share * (trials[i].radius_px - result.radius_px);
  }
  result.exists = isFinite(result.normal) && result.inverse_depth_per_m > 0;
  if (!result.exists) return last_ = {};
  result.tolerance_raw = job.measure.tolerance_raw;
  window_ = base + last;
  area_px_ = trials[last].area_px;
  last_ = trials[last].fitted;
  last_.exists = true;
  return result;
}

}  // namespace hapticd::rt
