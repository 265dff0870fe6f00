// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/deproject_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <cmath>

#include "hwy/highway.h"
#include "rt/modelling/deproject_kernel.h"
#include "rt/scene/compress-inl.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using RawTag = hn::Rebind<std::uint16_t, FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Uints = hn::Vec<UintTag>;

/// Returns the cell index of a position, 0..last_cell. Adding 2^23 - 0.5 leaves the integer part of a small
/// positive number in the low bits, which takes fewer instructions than a conversion that handles overflow. A
/// position closer to a cell's border than the rounding error may be assigned to the cell before it. Below
/// half a voxel the sum would not reach 2^23, so such positions are treated as half a voxel, which lies in
/// cell 0 as well.
HWY_INLINE hn::Vec<IntTag> cellOf(Floats position, Floats voxels_per_m, Floats half_voxel_m,
                                  std::int32_t last_cell) {
  const FloatTag df;
  const IntTag di;
  constexpr float kTwoTo23 = 8388608.0F;
  constexpr std::int32_t kBitsOfTwoTo23 = 0x4B000000;
  const auto shifted =
      hn::MulAdd(hn::Max(position, half_voxel_m), voxels_per_m, hn::Set(df, kTwoTo23 - 0.5F));
  return hn::Min(hn::Sub(hn::BitCast(di, shifted), hn::Set(di, kBitsOfTwoTo23)), hn::Set(di, last_cell));
}

/// Converts pixels to single-precision positions, one vector at a time. The same pixel always gives the same
/// position.
template <bool kLinear>
class Deprojector {
 public:
  HWY_INLINE explicit Deprojector(const DeprojectJob& job)
      : depth_m_(job.tables->depth_m),
        raw_values_(job.tables->raw_values),
        raw_first_(hn::Set(UintTag(), job.raw_first)),
        unit_m_(hn::Set(FloatTag(), job.tables->unit_m)),
        middle_column_(hn::Set(FloatTag(), job.tables->middle_column)),
        middle_row_(hn::Set(FloatTag(), job.tables->middle_row)),
        x_(job.tables->middle.x, job.tables->column_step.x, job.tables->row_step.x, job.camera_x_m),
        y_(job.tables->middle.y, job.tables->column_step.y, job.tables->row_step.y, job.camera_y_m),
        z_(job.tables->middle.z, job.tables->column_step.z, job.tables->row_step.z, job.camera_z_m) {}

  /// Returns the depths of packed pixels; `typical_raw` is the raw value of one of them. A linear law takes a
  /// product, others a table. Neighbouring pixels mostly have nearly the same disparity. Then one vector of
  /// the table around it and a permutation suffice, which is several times faster than gathering each lane.
  HWY_INLINE Floats depth(Uints pixel, std::uint32_t typical_raw) const {
    const FloatTag df;
    const IntTag di;
    const UintTag du;
    const auto above_first = hn::And(hn::Sub(pixel, raw_first_), hn::Set(du, PackedPixel::kRawRange - 1));
    const auto raw = hn::BitCast(di, hn::Add(above_first, raw_first_));
    if constexpr (kLinear) return hn::Mul(hn::ConvertTo(df, raw), unit_m_);
    constexpr std::int32_t kLanes = hn::MaxLanes(df);
    const std::int32_t start =
        std::max(0, std::min(static_cast<std::int32_t>(typical_raw) - kLanes / 2, raw_values_ - kLanes));
    const auto from_start = hn::Sub(raw, hn::Set(di, start));
    const auto outside = hn::Gt(hn::BitCast(du, from_start), hn::Set(du, kLanes - 1));  // or below the start
    if (hn::AllFalse(du, outside)) {
      return hn::TableLookupLanes(hn::LoadU(df, depth_m_ + start), hn::IndicesFromVec(df, from_start));
    }
    return hn::GatherIndex(df, depth_m_, raw);
  }

  HWY_INLINE void positions(Uints pixel, Floats depth, Floats& x, Floats& y, Floats& z) const {
    const FloatTag df;
    const IntTag di;
    const UintTag du;
    const auto column =
        hn::And(hn::ShiftRight<PackedPixel::kRawBits>(pixel), hn::Set(du, PackedPixel::column(~0U)));
    const auto row = hn::ShiftRight<PackedPixel::kRawBits + PackedPixel::kColumnBits>(pixel);
    const auto u = hn::Sub(hn::ConvertTo(df, hn::BitCast(di, column)), middle_column_);
    const auto v = hn::Sub(hn::ConvertTo(df, hn::BitCast(di, row)), middle_row_);
    x = x_.position(u, v, depth);
    y = y_.position(u, v, depth);
    z = z_.position(u, v, depth);
  }

 private:
  /// One coordinate of all rays and of the camera position.
  struct Axis {
    HWY_INLINE Axis(float middle_, float column_step_, float row_step_, float camera_)
        : middle(hn::Set(FloatTag(), middle_)),
          column_step(hn::Set(FloatTag(), column_step_)),
          row_step(hn::Set(FloatTag(), row_step_)),
          camera(hn::Set(FloatTag(), camera_)) {}
    HWY_INLINE Floats position(Floats u, Floats v, Floats depth) const {
      return hn::MulAdd(depth, hn::MulAdd(u, column_step, hn::MulAdd(v, row_step, middle)), camera);
    }
    Floats middle, column_step, row_step, camera;
  };

  const float* depth_m_;
  std::int32_t raw_values_;
  Uints raw_first_;
  Floats unit_m_, middle_column_, middle_row_;
  Axis x_, y_, z_;
};

/// Collects the pixels of a row whose raw value is in the window's range; returns their number.
HWY_INLINE std::size_t pixelsInRange(const DeprojectJob& job, int row) {
  const IntTag di;
  const UintTag du;
  const RawTag dr;
  const int lanes = static_cast<int>(hn::Lanes(di));
  const std::uint16_t* const raw_row = job.raw + static_cast<std::ptrdiff_t>(row) * job.stride_px;
  const auto below_first = hn::Set(di, job.window.raw_first - 1);
  const auto above_last = hn::Set(di, job.window.raw_last + 1);
  const auto columns = hn::ShiftLeft<PackedPixel::kRawBits>(hn::Iota(du, 0));
  std::size_t count = 0;
  // Starting at a multiple of the lane count, of which the distance of the rows is one as well, so that whole
  // vectors never pass the end of the row; its padding has no measurements.
  for (int column = job.window.column_first / lanes * lanes; column <= job.window.column_last;
       column += lanes) {
    const auto raw = hn::PromoteTo(di, hn::LoadU(dr, raw_row + column));
    const auto in_range = hn::And(hn::Gt(raw, below_first), hn::Lt(raw, above_last));
    const auto first = hn::Set(
        du, PackedPixel::pack(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), 0));
    const auto low_bits = hn::And(hn::BitCast(du, raw), hn::Set(du, PackedPixel::kRawRange - 1));
    const auto pixel = hn::Or(hn::Add(columns, first), low_bits);
    hn::StoreU(compress(du, pixel, hn::RebindMask(du, in_range)), du, job.pixel_of_row + count);
    count += hn::CountTrue(di, in_range);
  }
  return count;
}

/// Appends the points of one row of pixels; with kBall only those inside the ball.
template <bool kBall, bool kLinear>
HWY_INLINE void appendPoints(DeprojectJob& job, const Deprojector<kLinear>& deprojector, int row) {
  const FloatTag df;
  const IntTag di;
  const UintTag du;
  const auto lanes = hn::Lanes(df);
  const std::size_t count = pixelsInRange(job, row);
  const auto ball_x = hn::Set(df, job.ball_x_m);
  const auto ball_y = hn::Set(df, job.ball_y_m);
  const auto ball_z = hn::Set(df, job.ball_z_m);
  const auto radius_squared = hn::Set(df, job.ball_radius_squared_m2);
  const auto voxels_per_m = hn::Set(df, job.voxels_per_m);
  const auto half_voxel_m = hn::Set(df, 0.5F / job.voxels_per_m);
  const std::uint32_t row_begin = job.points;

  for (std::size_t i = 0; i < count; i += lanes) {
    const auto pixel = hn::LoadU(du, job.pixel_of_row + i);
    const auto depth = deprojector.depth(pixel, PackedPixel::raw(job.pixel_of_row[i], job.raw_first));
    Floats x, y, z;
    deprojector.positions(pixel, depth, x, y, z);
    auto keep = hn::Gt(depth, hn::Zero(df));
    if constexpr (kBall) {
      const auto from_x = hn::Sub(x, ball_x);
      const auto from_y = hn::Sub(y, ball_y);
      const auto from_z = hn::Sub(z, ball_z);
      const auto distance_squared =
          hn::MulAdd(from_z, from_z, hn::MulAdd(from_y, from_y, hn::Mul(from_x, from_x)));
      keep = hn::And(keep, hn::Le(distance_squared, radius_squared));
    }
    if (count - i < lanes) keep = hn::And(keep, hn::FirstN(df, count - i));
    const auto kept = static_cast<std::uint32_t>(hn::CountTrue(df, keep));
    if (kept == 0) continue;

    const auto cell_x = cellOf(x, voxels_per_m, half_voxel_m, job.last_cell_x);
    const auto cell_y = cellOf(y, voxels_per_m, half_voxel_m, job.last_cell_y);
    const auto cell_z = cellOf(z, voxels_per_m, half_voxel_m, job.last_cell_z);
    const auto grid_row = hn::Add(hn::Mul(cell_z, hn::Set(di, job.cells_y)), cell_y);
    const auto voxel = hn::BitCast(du, hn::Add(hn::Mul(grid_row, hn::Set(di, job.bits_per_row)), cell_x));
    const std::uint32_t begin = job.points;
    float* const points = reinterpret_cast<float*>(job.points_in_image_order + begin);
    std::uint32_t* const voxels = job.voxel_of_row + 1 + begin - row_begin;
    const auto packed = hn::BitCast(df, pixel);
    // Compressed in a register and stored whole, because compressing stores are slow on some machines.
    if (kept == lanes) {
      hn::StoreInterleaved4(x, y, z, packed, df, points);
      hn::StoreU(voxel, du, voxels);
    } else {
      hn::StoreInterleaved4(compress(df, x, keep), compress(df, y, keep), compress(df, z, keep),
                            compress(df, packed, keep), df, points);
      hn::StoreU(compress(du, voxel, hn::RebindMask(du, keep)), du, voxels);
    }
    const std::uint32_t taken = std::min(kept, job.point_capacity - begin);
    job.points = begin + taken;
    job.points_over_capacity += kept - taken;
  }
}

/// Starts a run at every point from `first` (the first point of its row) on whose voxel differs from that of
/// the point before it.
HWY_INLINE void appendRuns(DeprojectJob& job, std::uint32_t first) {
  const UintTag du;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(du));
  const auto first_points = hn::Iota(du, first);
  const std::uint32_t count = job.points - first;
  std::size_t run_count = job.run_count;
  for (std::uint32_t i = 0; i < count; i += lanes) {
    const auto voxel = hn::LoadU(du, job.voxel_of_row + 1 + i);
    auto starts = hn::Ne(voxel, hn::LoadU(du, job.voxel_of_row + i));
    if (count - i < lanes) starts = hn::And(starts, hn::FirstN(du, count - i));
    const auto point = hn::Add(first_points, hn::Set(du, i));
    hn::StoreU(compress(du, voxel, starts), du, job.run_voxel + run_count);
    hn::StoreU(compress(du, point, starts), du, job.run_begin + run_count);
    run_count += hn::CountTrue(du, starts);
  }
  job.run_count = run_count;
}

template <bool kLinear>
HWY_INLINE void deprojectRows(DeprojectJob& job) {
  job.voxel_of_row[0] = ~0U;  // no voxel, so the first point of a row starts a run
  const Deprojector<kLinear> deprojector(job);
  const bool has_ball = std::isfinite(job.ball_radius_squared_m2);
  for (int row = job.window.row_first; row <= job.window.row_last; ++row) {
    const std::uint32_t first = job.points;
    if (has_ball) {
      appendPoints<true>(job, deprojector, row);
    } else {
      appendPoints<false>(job, deprojector, row);
    }
    appendRuns(job, first);
  }
  job.run_begin[job.run_count] = job.points;
}

void deprojectFrame(DeprojectJob& job) {
  if (job.tables->depth_m == nullptr) {
    deprojectRows<true>(job);
  } else {
    deprojectRows<false>(job);
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(deprojectFrame);

void deproject(DeprojectJob& job) noexcept {
  HWY_DYNAMIC_DISPATCH(deprojectFrame)(job);
}

}  // namespace hapticd::rt
#endif
