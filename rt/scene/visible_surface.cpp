// SPDX-License-Identifier: Apache-2.0
#include "rt/scene/visible_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace hapticd::rt {
namespace {

/// One vector register on every machine; the compiler's vector type suffices, because only four lanes are
/// needed.
using Four = float __attribute__((vector_size(16)));

/// Loads a facet into one register: disparity and its change per column, per row and per second.
Four numbersOf(const Facet& facet) noexcept {
  Four numbers;
  std::memcpy(&numbers, &facet, sizeof numbers);
  return numbers;
}

/// The four facets around an image position and the bilinear weights of that position.
struct Corners {
  const Facet* upper;  // upper left; the upper right one follows
  const Facet* lower;
  float t;  // horizontal position, 0..1 from left to right
  float s;  // vertical position, 0..1 from top to bottom
};

/// Cubic Hermite polynomials at one position between two ends, or their derivatives: weights of the values at
/// both ends and of the slopes there.
struct Hermite {
  float value[2];
  float slope[2];

  static Hermite at(float t) noexcept {
    const float rise = t * t * (3 - 2 * t);
    return {{1 - rise, rise}, {t * (1 - t) * (1 - t), t * t * (t - 1)}};
  }
  static Hermite derivativeAt(float t) noexcept {
    const float rise = 6 * t * (1 - t);
    return {{-rise, rise}, {(1 - t) * (1 - 3 * t), t * (3 * t - 2)}};
  }
  float of(float first, float last, float first_slope, float last_slope) const noexcept {
    return value[0] * first + value[1] * last + slope[0] * first_slope + slope[1] * last_slope;
  }
};

/// Interpolates the surface between four facets from their values and slopes, so that both pass into those of
/// the next cell; exact where the disparity is quadratic. The slopes are the gradient of the values.
Four blended(const Corners& cell) noexcept {
  constexpr float kSide = BlockLattice::kBlock_px;
  const float t = cell.t;
  const float s = cell.s;
  const Four a = numbersOf(cell.upper[0]);
  const Four b = numbersOf(cell.upper[1]);
  const Four c = numbersOf(cell.lower[0]);
  const Four d = numbersOf(cell.lower[1]);
  const Four upper = a + t * (b - a);
  const Four lower = c + t * (d - c);
  // The mixed derivative, the same at all corners, in units of the cell as the slopes.
  const float twist = 0.25F * kSide * ((c[1] - a[1]) + (d[1] - b[1]) + (b[2] - a[2]) + (d[2] - c[2]));
  // Along the upper and the lower side: the disparity above that of the first corner, and its change
  // downwards.
  const auto alongSides = [&](const Hermite& h) {
    const float twists = twist * (h.slope[0] + h.slope[1]);
    return std::array{h.of(0, b[0] - a[0], kSide * a[1], kSide * b[1]),
                      h.of(c[0] - a[0], d[0] - a[0], kSide * c[1], kSide * d[1]),
                      kSide * (h.value[0] * a[2] + h.value[1] * b[2]) + twists,
                      kSide * (h.value[0] * c[2] + h.value[1] * d[2]) + twists};
  };
  const std::array<float, 4> sides = alongSides(Hermite::at(t));
  const std::array<float, 4> slopes = alongSides(Hermite::derivativeAt(t));
  const Hermite down = Hermite::at(s);
  const Hermite down_slope = Hermite::derivativeAt(s);
  const auto between = [](const Hermite& h, const std::array<float, 4>& of) {
    return h.of(of[0], of[1], of[2], of[3]);
  };
  return Four{a[0] + between(down, sides), between(down, slopes) / kSide, between(down_slope, sides) / kSide,
              upper[3] + s * (lower[3] - upper[3])};
}

/// Evaluates the plane of the i-th facet, in row order, at the position.
Four planeOf(const Corners& cell, int i) noexcept {
  constexpr float kSide = BlockLattice::kBlock_px;
  Four numbers = numbersOf((i < 2 ? cell.upper : cell.lower)[i & 1]);
  const float du = kSide * (cell.t - static_cast<float>(i & 1));
  const float dv = kSide * (cell.s - static_cast<float>(i >> 1));
  numbers[0] += numbers[1] * du + numbers[2] * dv;
  return numbers;
}

/// Evaluates the surface where faces meet: each face extends up to the crease.
Four atCrease(const Corners& cell, bool least) noexcept {
  Four chosen = planeOf(cell, 0);
  for (int i = 1; i < 4; ++i) {
    const Four numbers = planeOf(cell, i);
    if ((numbers[0] < chosen[0]) == least) chosen = numbers;
  }
  return chosen;
}

/// Returns the slope at a pixel from its two neighbours, limited to that of the flatter side; where a surface
/// ends, the other side determines it.
float slopeBetween(int before, int raw, int behind) noexcept {
  if (before >= kNoRawDisparity || behind >= kNoRawDisparity) return 0;
  const int up = raw - before;
  const int down = behind - raw;
  if ((up < 0) != (down < 0)) return 0;
  return static_cast<float>(std::abs(up) < std::abs(down) ? up : down);
}

/// Estimates the surface at a position from its pixel and the neighbours, for surfaces that are too steep or
/// too small for facets.
Four estimateFromPixel(const std::uint16_t* image, const DepthModel& model, int row, int column,
                       const ImagePosition& at) noexcept {
  const int stride = model.stride_px();
  const std::uint16_t* const pixel = image + row * stride + column;
  const bool has_columns = column > 0 && column + 1 < model.width_px();
  const bool has_rows = row > 0 && row + 1 < model.height_px();
  const float per_column = has_columns ? slopeBetween(pixel[-1], *pixel, pixel[1]) : 0;
  const float per_row = has_rows ? slopeBetween(pixel[-stride], *pixel, pixel[stride]) : 0;
  const float raw = static_cast<float>(*pixel) + per_column * static_cast<float>(at.u - column) +
                    per_row * static_cast<float>(at.v - row);
  return Four{raw, per_column, per_row, 0};
}

/// Estimates the surface at a position from those facets that the pixel's measurement belongs to. Returns
/// false if there is none.
bool estimateFromFacets(const Corners& cell, float raw, float of_facet_raw, Four& numbers_of_pixel) noexcept {
  const float weight_of[4] = {(1 - cell.t) * (1 - cell.s), cell.t * (1 - cell.s), (1 - cell.t) * cell.s,
                              cell.t * cell.s};
  const Facet* const facet_of[4] = {cell.upper, cell.upper + 1, cell.lower, cell.lower + 1};
  Four sum{};
  float weight = 0;
  for (int i = 0; i < 4; ++i) {
    if (facet_of[i]->disparity < 0) continue;
    const Four numbers = planeOf(cell, i);
    if (std::abs(numbers[0] - raw) > of_facet_raw) continue;
    const float share = weight_of[i] + 1e-3F;
    sum += share * numbers;
    weight += share;
  }
  if (weight > 0) numbers_of_pixel = (1 / weight) * sum;
  return weight > 0;
}

/// The pixel that shows an image position.
struct Pixel {
  int row;
  int column;
};

Pixel pixelAt(const DepthModel& model, const ImagePosition& image) noexcept {
  return {std::clamp(static_cast<int>(std::lround(image.v)), 0, model.height_px() - 1),
          std::clamp(static_cast<int>(std::lround(image.u)), 0, model.width_px() - 1)};
}

enum class Known : std::uint8_t { no, beyond_view, yes };

/// Estimates the surface of a layer at a position from its facets, or from its pixels where there are none.
Known estimateFromLayer(const VisibleSurface& surface, const SurfaceLayer& layer, const DepthModel& model,
                        const ImagePosition& image, Four& numbers) noexcept {
  constexpr double kPerBlock = 1.0 / BlockLattice::kBlock_px;
  const BlockWindow& window = surface.blocks;
  if (window.columns() < 2 || window.rows() < 2) return Known::no;
  const double block_u = std::clamp((image.u - BlockLattice::kMiddle_px) * kPerBlock,
                                    static_cast<double>(window.column_first), window.column_last - 1e-6);
  const double block_v = std::clamp((image.v - BlockLattice::kMiddle_px) * kPerBlock,
                                    static_cast<double>(window.row_first), window.row_last - 1e-6);
  const int column = std::min(static_cast<int>(block_u), window.column_last - 1);
  const int row = std::min(static_cast<int>(block_v), window.row_last - 1);
  const std::size_t index = surface.lattice.at(row, column);
  const Corners corners{layer.facet + index, layer.facet + index + surface.lattice.columns,
                        static_cast<float>(block_u - column), static_cast<float>(block_v - row)};
  const Cell cell = layer.cell[index];
  if (cell == Cell::smooth) {
    numbers = blended(corners);
  } else if (cell != Cell::mixed) {
    numbers = atCrease(corners, cell == Cell::least);
  } else {
    const Pixel pixel = pixelAt(model, image);
    const std::uint16_t raw = layer.image[pixel.row * model.stride_px() + pixel.column];
    if (raw >= kNoRawDisparity) return raw == SurfaceLayer::kBeyondView ? Known::beyond_view : Known::no;
    if (!estimateFromFacets(corners, static_cast<float>(raw), surface.of_facet_raw, numbers))
      numbers = estimateFromPixel(layer.image, model, pixel.row, pixel.column, image);
  }
  return Known::yes;
}

/// The share that the body or corner at the focus has in the surface: 0 where the pixel does not belong to
/// it, falling to 0 towards the end of the window that it was fitted to.
struct FocusShare {
  float value = 0;
  float per_column = 0;
  float per_row = 0;
};

/// Where a position is relative to the focus.
struct FromFocus {
  double du;
  double dv;
  double square;

  template <typename Shape>
  FromFocus(const ImagePosition& image, const Shape& shape) noexcept
      : du(image.u - shape.column_px), dv(image.v - shape.row_px), square(du * du + dv * dv) {}
};

/// Returns the share of a shape at the focus with these numbers at the position.
FocusShare shareOf(const FromFocus& at, double radius_px, double tolerance_raw, const Four& numbers,
                   std::uint16_t raw) noexcept {
  if (raw >= kNoRawDisparity) return {};
  const double within_pixel = 0.5 * (std::abs(double{numbers[1]}) + std::abs(double{numbers[2]}));
  const double off = std::abs(static_cast<double>(raw) - double{numbers[0]}) - within_pixel;
  // A single pixel may be noisier, so its say ends softly.
  constexpr double kFades = 0.5;
  const double belongs = std::clamp((1 + kFades - off / tolerance_raw) / kFades, 0.0, 1.0);
  if (belongs <= 0) return {};
  constexpr double kWhole = 0.75;
  const double distance = std::sqrt(at.square);
  const double t = std::clamp((distance / radius_px - kWhole) / (1 - kWhole), 0.0, 1.0);
  FocusShare share{.value = static_cast<float>(belongs * (1 - t * t * (3 - 2 * t)))};
  if (t > 0) {
    const double per_px = -6 * belongs * t * (1 - t) / (radius_px * (1 - kWhole) * distance);
    share.per_column = static_cast<float>(per_px * at.du);
    share.per_row = static_cast<float>(per_px * at.dv);
  }
  return share;
}

std::uint16_t rawAt(const SurfaceLayer& layer, const DepthModel& model, const ImagePosition& image) noexcept {
  const Pixel pixel = pixelAt(model, image);
  return layer.image[pixel.row * model.stride_px() + pixel.column];
}

/// Estimates the surface at a position from the body at the focus.
FocusShare estimateFromBody(const FocusBody& body, const SurfaceLayer& layer, const DepthModel& model,
                            const ImagePosition& image, Four& numbers) noexcept {
  if (!body.exists) return {};
  const FromFocus at(image, body);
  if (at.square >= body.radius_px * body.radius_px) return {};
  const DepthModelParameters& camera = model.parameters();
  const FocusBody::Crossing there = body.crossing(at.du / camera.fx_px, at.dv / camera.fy_px);
  if (!there.exists) return {};
  const DisparityScale& scale = model.disparity();
  const double w = body.inverse_depth_per_m / there.stretch;
  // The inverse depth changes by -w N / (N r) per unit of the ray, with the normal N and the ray r.
  const double per_ray = -w / (there.cosine * scale.a_per_m);
  numbers = Four{static_cast<float>((w - scale.b_per_m) / scale.a_per_m),
                 static_cast<float>(per_ray * there.normal.x / camera.fx_px),
                 static_cast<float>(per_ray * there.normal.y / camera.fy_px),
                 static_cast<float>(body.per_second.at(image.u, image.v))};
  return shareOf(at, body.radius_px, body.tolerance_raw, numbers, rawAt(layer, model, image));
}

/// Estimates the surface at a position from the corner at the focus.
FocusShare estimateFromCorner(const FocusCorner& corner, const SurfaceLayer& layer, const DepthModel& model,
                              const ImagePosition& image, Four& numbers) noexcept {
  if (corner.faces == 0) return {};
  const FromFocus at(image, corner);
  if (at.square >= corner.radius_px * corner.radius_px) return {};
  const FocusCorner::Face& face = corner.faceAt(at.du, at.dv);
  numbers =
      Four{static_cast<float>(face.at(at.du, at.dv)), static_cast<float>(face.per_column),
           static_cast<float>(face.per_row), static_cast<float>(corner.per_second.at(image.u, image.v))};
  FocusShare share = shareOf(at, corner.radius_px, corner.tolerance_raw, numbers, rawAt(layer, model, image));
  const auto agrees = static_cast<float>(corner.share);
  share.value *= agrees;
  share.per_column *= agrees;
  share.per_row *= agrees;
  return share;
}

/// Mixes two estimates; the share of the first one changes over the image.
Four mixed(const Four& first, const FocusShare& share, const Four& second) noexcept {
  const Four more = first - second;
  Four numbers = second + share.value * more;
  numbers[1] += share.per_column * more[0];
  numbers[2] += share.per_row * more[0];
  return numbers;
}

/// Estimates the surface of a layer at a position from the body at the focus and, beside that, from facets
/// and pixels.
Known estimateFromBodyAndLayer(const VisibleSurface& surface, const SurfaceLayer& layer,
                               const DepthModel& model, const ImagePosition& image, Four& numbers) noexcept {
  const FocusShare body = estimateFromBody(surface.body, layer, model, image, numbers);
  if (body.value >= 1) return Known::yes;
  Four of_layer{};
  const Known known = estimateFromLayer(surface, layer, model, image, of_layer);
  if (known != Known::yes) return body.value > 0 ? Known::yes : known;
  numbers = mixed(numbers, body, of_layer);
  return Known::yes;
}

/// Estimates the surface of a layer at a position from the best that is known there.
Known estimate(const VisibleSurface& surface, const SurfaceLayer& layer, const DepthModel& model,
               const ImagePosition& image, Four& numbers) noexcept {
  const FocusShare corner = estimateFromCorner(surface.corner, layer, model, image, numbers);
  if (corner.value >= 1) return Known::yes;
  Four of_others{};
  const Known known = estimateFromBodyAndLayer(surface, layer, model, image, of_others);
  if (known != Known::yes) return corner.value > 0 ? Known::yes : known;
  numbers = corner.value > 0 ? mixed(numbers, corner, of_others) : of_others;
  return Known::yes;
}

}  // namespace

double SurfaceView::shellAt(double depth_m) const noexcept {
  constexpr double kNoiseUnits = 0.5;
  constexpr double kMin_m = 0.01;
  return std::max(kMin_m, shell_m_ - kNoiseUnits * noiseUnit_m(depth_m));
}

Sheet SurfaceView::sheetOf(const SurfaceLayer& layer, const ImagePosition& image) const HAPTICD_RT {
  Sheet sheet;
  Four numbers{};
  const Known known = estimate(surface_, layer, model_, image, numbers);
  if (known != Known::yes) {
    sheet.beyond_view = known == Known::beyond_view;
    return sheet;
  }
  const double a = model_.disparity().a_per_m;
  const double w = a * (double{numbers[0]} + age_s_ * double{numbers[3]}) + model_.disparity().b_per_m;
  if (!(w > 0)) return sheet;
  sheet.extrapolated_per_m = a * age_s_ * double{numbers[3]};
  const double w_u = a * double{numbers[1]};
  const double w_v = a * double{numbers[2]};
  // The plane with 1/Z = w at this pixel and these slopes is N * X = 1, with x right, y down, Z forward.
  const double x = w_u * camera_.fx_px;
  const double y = w_v * camera_.fy_px;
  const double z = w - w_u * (image.u - camera_.cx_px) - w_v * (image.v - camera_.cy_px);
  const double length = std::sqrt(x * x + y * y + z * z);
  sheet.exists = true;
  sheet.inverse_depth_per_m = w;
  sheet.distance_m = 1 / length;
  sheet.normal_in_camera = sheet.distance_m * Vec3{-x, y, z};
  // The ray meets the surface at the depth 1/w, which changes by -w' / w^2. The ray's direction has depth 1,
  // so it meets the plane N * X = 1 where N * ray = w.
  sheet.speed_m_per_s = sheet.distance_m * a * double{numbers[3]} / w;
  return sheet;
}

SurfaceView::Place SurfaceView::sample(const Vec3& p) const HAPTICD_RT {
  const double depth = depthOf(p);
  if (!(depth > kNearest_m)) return {};
  const ImagePosition image = project(p);
  if (!isInImage(image)) return {.where = Where::beyond, .sheet = {}, .distance_m = 0};
  const double shell_m = shellAt(depth);
  // Too far behind a sheet along the ray, where the measurement is uncertain. An outline tilts flat surfaces,
  // so the distance from the plane alone is not sufficient; on steep surfaces it must be large as well.
  constexpr double kShareOfShell = 0.65;
  const auto isBehind = [&p, depth, shell_m](const Sheet& sheet) {
    return depth - sheet.depth_m() > shell_m && -distanceFrom(sheet, p) > kShareOfShell * shell_m;
  };
  const auto placeAtSheet = [&p](const Sheet& sheet) -> Place {
    const double distance = distanceFrom(sheet, p);
    return {distance >= 0 ? Where::free : Where::inside, sheet, distance};
  };
  const Sheet nearest = sheetOf(surface_.visible, image);
  const bool counts = nearest.exists && !isBehind(nearest);
  if (counts && !looks_past_) return placeAtSheet(nearest);
  if (surface_.hides_anything) {
    const Sheet hidden = sheetOf(surface_.hidden, image);
    const bool is_hidden = !counts || looksPast(nearest, hidden);
    if (hidden.exists && is_hidden && !isBehind(hidden)) return placeAtSheet(hidden);
  }
  if (counts) return placeAtSheet(nearest);
  const Where where = nearest.exists ? Where::unseen : nearest.beyond_view ? Where::beyond : Where::free;
  return {.where = where, .sheet = {}, .distance_m = 0};
}

bool SurfaceView::looksPast(const Sheet& nearest, const Sheet& hidden) const noexcept {
  return looks_past_ && hidden.exists && hidden.depth_m() - nearest.depth_m() > shellAt(hidden.depth_m());
}

Sheet SurfaceView::sheetNear(const ImagePosition& image, double depth_m) const HAPTICD_RT {
  const Sheet nearest = sheetOf(surface_.visible, image);
  if (!surface_.hides_anything) return nearest;
  const Sheet hidden = sheetOf(surface_.hidden, image);
  if (!nearest.exists || !hidden.exists) return nearest.exists ? nearest : hidden;
  if (looksPast(nearest, hidden)) return hidden;
  const bool nearer = std::abs(nearest.depth_m() - depth_m) <= std::abs(hidden.depth_m() - depth_m);
  return nearer ? nearest : hidden;
}

}  // namespace hapticd::rt
