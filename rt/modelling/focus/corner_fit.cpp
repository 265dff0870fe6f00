// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/focus/corner_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Dense>

#include "rt/modelling/focus/corner_kernel.h"

namespace hapticd::rt {
namespace {

using Face = FocusCorner::Face;

/// Largest tangent of the angle between a face and the image: what is steeper is an outline.
constexpr double kSteepest = 5;
/// Faces that turn by less are one.
constexpr double kLeastTurn_cos = 0.97;  // 14 degrees
/// Share of the samples that may belong to no face.
constexpr double kMostOutside = 0.06;
/// A cell with fewer samples does not determine a plane.
constexpr double kLeastInCell = 10;
/// Keeps the equations regular where the samples lie on a line.
constexpr double kLeastInformation = 1e-6;

/// Changes a face by what its samples' residuals ask for.
void improve(Face& face, const FaceSums& s) noexcept {
  Eigen::Matrix3d matrix{{s.w, s.wx, s.wy}, {s.wx, s.wxx, s.wxy}, {s.wy, s.wxy, s.wyy}};
  matrix.diagonal().array() += kLeastInformation;
  const Eigen::Vector3d change = matrix.ldlt().solve(Eigen::Vector3d(s.wr, s.wrx, s.wry));
  face.disparity += change[0];
  face.per_column += change[1];
  face.per_row += change[2];
}

/// Fits faces to the samples of one window.
class FaceFit {
 public:
  /// How disparities belong to a corner, raw units.
  struct Measure {
    double at_focus_raw;
    double tolerance_raw;  ///< samples that differ by more do not belong to it
    double beside_raw;     ///< those that differ by less than this belong to something that touches it
    double raw_per_px;     ///< change of disparity per pixel of a plane at 45 degrees to the view
    double radius_px;      ///< of the window
    double least_samples;  ///< fewer do not determine a face
  };

  FaceFit(const FocusSamples& samples, const Measure& measure) noexcept
      : samples_(samples), measure_(measure) {}

  /// Returns the faces and their kind; without faces if there is no corner. `start`: of a frame before or of
  /// a smaller window; without faces if nothing is known. `sums`: over the samples.
  FocusCorner fit(const FocusCorner& start, CornerSums& sums) noexcept;

 private:
  CornerSums sumsOf(FaceChoice choice) const noexcept {
    return cornerSumsOf(samples_, corner_, choice, measure_.tolerance_raw, measure_.beside_raw);
  }
  bool addFace() noexcept;
  void chooseKind() noexcept;
  void refine(FaceChoice choice, int passes) noexcept;
  void removeUndetermined(const CornerSums& sums) noexcept;
  bool isSharp() const noexcept;

  const FocusSamples& samples_;
  const Measure& measure_;
  FocusCorner corner_;
};

/// Begins a face where most of the samples belong to none, with the plane through those in one cell; the
/// first one where the samples are most like a plane. Returns false if there is none.
bool FaceFit::addFace() noexcept {
  const double farthest_raw = measure_.tolerance_raw + kSteepest * measure_.raw_per_px * measure_.radius_px;
  const bool is_first = corner_.faces == 0;
  Face best;
  double best_score = is_first ? -std::numeric_limits<double>::infinity() : 0;
  for (int cell = 0; cell < FocusSamples::kCells; ++cell) {
    FaceSums s{};
    double square = 0;
    for (std::size_t i = samples_.cell_begin[cell]; i < samples_.cell_begin[cell + 1]; ++i) {
      if (!(samples_.weight[i] > 0)) continue;
      const double x = static_cast<double>(samples_.column_px[i]);
      const double y = static_cast<double>(samples_.row_px[i]);
      const double r = static_cast<double>(samples_.disparity_raw[i]) - measure_.at_focus_raw;
      if (std::abs(r) > farthest_raw) continue;
      const auto belongs = [&](const Face& face) {
        return std::abs(r + measure_.at_focus_raw - face.at(x, y)) < measure_.tolerance_raw;
      };
      if (std::any_of(corner_.face, corner_.face + corner_.faces, belongs)) continue;
      s.w += 1;
      s.wx += x;
      s.wy += y;
      s.wxx += x * x;
      s.wxy += x * y;
      s.wyy += y * y;
      s.wr += r;
      s.wrx += r * x;
      s.wry += r * y;
      square += r * r;
    }
    if (s.w < kLeastInCell) continue;
    Face face{.disparity = measure_.at_focus_raw};
    improve(face, s);
    const double fitted =
        (face.disparity - measure_.at_focus_raw) * s.wr + face.per_column * s.wrx + face.per_row * s.wry;
    const double score = is_first ? -(square - fitted) / s.w : s.w;
    if (score <= best_score || std::abs(face.disparity - measure_.at_focus_raw) > farthest_raw) continue;
    best_score = score;
    best = face;
  }
  if (is_first ? std::isinf(best_score) : best_score == 0) return false;
  corner_.face[corner_.faces++] = best;
  return true;
}

void FaceFit::refine(FaceChoice choice, int passes) noexcept {
  for (int pass = 0; pass < passes; ++pass) {
    const CornerSums now = sumsOf(choice);
    for (int i = 0; i < corner_.faces; ++i) improve(corner_.face[i], now.face[i]);
  }
}

/// Convex or concave: whichever explains more.
void FaceFit::chooseKind() noexcept {
  const auto loss = [this](FaceChoice choice) { return sumsOf(choice).fit.loss(1, measure_.tolerance_raw); };
  corner_.greatest = loss(FaceChoice::greatest) < loss(FaceChoice::least);
}

/// Removes faces that too few samples belong to, and those that are outlines.
void FaceFit::removeUndetermined(const CornerSums& sums) noexcept {
  int kept = 0;
  for (int i = 0; i < corner_.faces; ++i) {
    const Face& face = corner_.face[i];
    const bool is_steep = std::hypot(face.per_column, face.per_row) > kSteepest * measure_.raw_per_px;
    if (!is_steep && sums.face[i].w > measure_.least_samples) corner_.face[kept++] = face;
  }
  corner_.faces = kept;
}

/// Returns whether the faces differ in direction.
bool FaceFit::isSharp() const noexcept {
  const auto normalOf = [this](const Face& face) {
    return Eigen::Vector3d(face.per_column / measure_.raw_per_px, face.per_row / measure_.raw_per_px, 1)
        .normalized()
        .eval();
  };
  for (int i = 0; i < corner_.faces; ++i) {
    for (int j = 0; j < i; ++j) {
      if (normalOf(corner_.face[i]).dot(normalOf(corner_.face[j])) > kLeastTurn_cos) return false;
    }
  }
  return corner_.faces > 1;
}

FocusCorner FaceFit::fit(const FocusCorner& start, CornerSums& sums) noexcept {
  constexpr int kPasses = 2;
  constexpr int kPassesOfNewFace = 3;
  corner_ = start;
  sums = {};
  const auto isComplete = [this, &sums] {
    return corner_.faces > 1 &&
           sums.fit.unexplained < kMostOutside * (sums.fit.explained + sums.fit.unexplained);
  };
  if (corner_.faces > 1) {
    refine(choiceOf(corner_), kPasses);
    sums = sumsOf(choiceOf(corner_));
  } else {
    if (!addFace()) return {};
    refine(FaceChoice::nearest, kPassesOfNewFace);
  }
  constexpr int kMaxNewFaces = FocusCorner::kMaxFaces - 1;
  for (int i = 0; i < kMaxNewFaces && !isComplete() && corner_.faces < FocusCorner::kMaxFaces; ++i) {
    if (!addFace()) break;
    refine(FaceChoice::nearest, kPasses);
    chooseKind();
    refine(choiceOf(corner_), kPassesOfNewFace);
    removeUndetermined(sums = sumsOf(choiceOf(corner_)));
    if (corner_.faces < 2) return {};
    sums = sumsOf(choiceOf(corner_));
  }
  const int faces = corner_.faces;
  removeUndetermined(sums);
  return corner_.faces == faces && isSharp() ? corner_ : FocusCorner{};
}

/// Returns 1 if the faces are the same as those known before, 0 if they differ by more than noise.
double sameness(const FocusCorner& now, const FocusCorner& before, const CornerSums& sums, double sigma_raw,
                double radius_px) noexcept {
  if (now.faces != before.faces || now.greatest != before.greatest) return 0;
  constexpr double kSame_sigma = 0.5;
  constexpr double kOther_sigma = 1;
  double farthest_raw = 0;
  for (int i = 0; i < now.faces; ++i) {
    const FaceSums& s = sums.face[i];
    const Face& a = now.face[i];
    const Face& b = before.face[i];
    const double off_raw = std::abs(a.at(s.wx / s.w, s.wy / s.w) - b.at(s.wx / s.w, s.wy / s.w));
    const double turned_raw =
        0.5 * radius_px * std::hypot(a.per_column - b.per_column, a.per_row - b.per_row);
    farthest_raw = std::max({farthest_raw, off_raw, turned_raw});
  }
  return fallingStep(farthest_raw / sigma_raw, kSame_sigma, kOther_sigma);
}

/// Brings the faces of a corner into the order of those of another one with as many: fits that begin
/// separately find them in different orders.
void sortLike(const FocusCorner& other, double radius_px, FocusCorner& corner) noexcept {
  const auto distance_raw = [radius_px](const Face& a, const Face& b) {
    return std::abs(a.disparity - b.disparity) +
           radius_px * std::hypot(a.per_column - b.per_column, a.per_row - b.per_row);
  };
  for (int i = 0; i < corner.faces; ++i) {
    Face* const nearest =
        std::min_element(corner.face + i, corner.face + corner.faces, [&](const Face& a, const Face& b) {
          return distance_raw(a, other.face[i]) < distance_raw(b, other.face[i]);
        });
    std::swap(corner.face[i], *nearest);
  }
}

/// Moves the faces of one corner by a share towards those of another with the same faces.
void approach(FocusCorner& corner, const FocusCorner& other, double share) noexcept {
  for (int i = 0; i < corner.faces; ++i) {
    Face& a = corner.face[i];
    const Face& b = other.face[i];
    a = {.disparity = std::lerp(a.disparity, b.disparity, share),
         .per_column = std::lerp(a.per_column, b.per_column, share),
         .per_row = std::lerp(a.per_row, b.per_row, share)};
  }
}

/// Returns the corner relative to another focus, after its surface has moved.
FocusCorner carriedTo(const FocusImage& image, const FocusCorner& corner,
                      const DisparityMotion& moved) noexcept {
  FocusCorner carried = corner.movedTo(image.column_px, image.row_px);
  for (Face& face : carried.face) {
    face.disparity += moved.at(image.column_px, image.row_px);
    face.per_column += moved.per_column;
    face.per_row += moved.per_row;
  }
  return carried;
}

}  // namespace

CornerFit::Trial CornerFit::tryWindow(const FocusImage& image, std::size_t window, double at_focus_raw,
                                      const FocusCorner& start, FocusSamples& samples) noexcept {
  constexpr double kLeastInFace = 20;
  Window& known = windows_[window];
  const double radius_px = image.radius_px(window);
  const int stride = FocusImage::strideFor(radius_px, FocusImage::kWholeWindow_px2);
  const double area_px2 = stride * stride;
  if (radius_px < FocusImage::kLeastRadius_px || image.collect(radius_px, stride, samples) == 0) {
    known.frames = 0;
    return {};
  }
  const FaceFit::Measure measure{
      .at_focus_raw = at_focus_raw,
      .tolerance_raw = image.tolerance_raw,
      .beside_raw = image.beside_raw,
      .raw_per_px = 1 / (image.px_per_m * image.unit_m),
      .radius_px = radius_px,
      .least_samples = std::max(kLeastInFace, FocusImage::kLeastPixels / area_px2)};
  CornerSums sums;
  Trial trial{.fitted = FaceFit(samples, measure).fit(start, sums)};
  if (trial.fitted.faces == 0) {
    known.frames = 0;
    return trial;
  }
  trial.fitted.column_px = image.column_px;
  trial.fitted.row_px = image.row_px;
  const double same =
      known.frames > 0 ? sameness(trial.fitted, known.mean, sums, image.sigma_raw, radius_px) : 0;
  const Misfit now =
      Misfit::of(sums.fit, image.sigma_raw, FocusImage::kPatch_px * FocusImage::kPatch_px / area_px2);
  known.misfit = now.mixedWith(known.misfit, std::max(image.newShare(), 1 - same));
  known.frames = 1 + same * std::min(known.frames, image.max_frames - 1);
  FocusCorner mean = trial.fitted;
  if (known.frames > 1) approach(mean, known.mean, 1 - 1 / known.frames);
  known.mean = mean;
  trial.agrees = known.misfit.agreement();
  return trial;
}

FocusCorner CornerFit::fit(const FocusImage& image, const Search& search, double at_focus_raw,
                           const DisparityMotion& moved, FocusSamples& samples) noexcept {
  constexpr std::size_t kWindows = FocusImage::kWindows;
  const FocusCorner carried = carriedTo(image, last_, moved);
  const bool warm = carried.faces > 0;
  if (!warm && wait_frames_-- > 0) return {};
  for (Window& window : windows_) {
    if (warm)
      window.mean = carriedTo(image, window.mean, moved);
    else
      window.frames = 0;
  }
  const auto attempt = [&](std::size_t window, const FocusCorner& start) {
    return tryWindow(image, window, at_focus_raw, start, samples);
  };
  // From the window of the frame before down to one that agrees, and from that up as far as they agree.
  std::array<Trial, kWindows> trials{};
  std::size_t top = warm ? std::max(search.least, window_) : search.first;
  std::size_t base = top;
  trials[base] = attempt(base, carried);
  while (trials[base].agrees < 1 && base > search.least) {
    --base;
    trials[base] = attempt(base, carried);
  }
  if (trials[base].agrees < 1 && warm) {
    const Trial again = attempt(base, {});
    if (again.agrees > trials[base].agrees) {
      trials[base] = again;
      top = base;
    }
  }
  // A corner may need a wider window to show.
  while (trials[base].fitted.faces == 0 && base + 1 < kWindows && base == top) {
    top = ++base;
    trials[base] = attempt(base, {});
  }
  while (trials[top].agrees > FocusImage::kLeastShare && top + 1 < kWindows) {
    ++top;
    trials[top] = attempt(top, trials[top - 1].fitted);
  }
  return combined(image, std::span(trials).subspan(base, top - base + 1), base);
}

FocusCorner CornerFit::combined(const FocusImage& image, std::span<const Trial> trials,
                                std::size_t base) noexcept {
  if (!(trials[0].agrees > 0)) {
    reject();
    return {};
  }
  FocusCorner result = windows_[base].mean;
  result.share = trials[0].agrees;
  result.radius_px = image.radius_px(base);
  result.tolerance_raw = image.tolerance_raw;
  double share = trials[0].agrees;
  std::size_t last = 0;
  for (std::size_t i = 1; i < trials.size() && share > 0; ++i) {
    FocusCorner wider = windows_[base + i].mean;
    share *= trials[i].agrees;
    if (wider.faces != result.faces || wider.greatest != result.greatest) break;
    sortLike(result, image.radius_px(base), wider);
    if (share > 0.5) last = i;
    approach(result, wider, share);
    result.radius_px += share * (image.radius_px(base + i) - result.radius_px);
  }
  window_ = base + last;
  last_ = trials[last].fitted;
  return result;
}

}  // namespace hapticd::rt
