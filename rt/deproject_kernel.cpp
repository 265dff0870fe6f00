#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/deproject_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>

#include "hwy/highway.h"
#include "rt/compress-inl.h"
#include "rt/deproject_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using UintTag = hn::RebindToUnsigned<FloatTag>;
using RawTag = hn::Rebind<std::uint16_t, FloatTag>;

HWY_INLINE hn::Vec<IntTag> cellOf(hn::Vec<FloatTag> position, hn::Vec<FloatTag> voxels_per_m,
                                  std::int32_t last_cell) {
  const IntTag di;
  const auto cell = hn::ConvertTo(di, hn::Mul(position, voxels_per_m));
  return hn::Min(hn::Max(cell, hn::Zero(di)), hn::Set(di, last_cell));
}

/// Appends the points of one row of pixels.
HWY_INLINE void deprojectRow(DeprojectJob& job, int row) {
  const FloatTag df;
  const IntTag di;
  const UintTag du;
  const RawTag dr;
  const int lanes = static_cast<int>(hn::Lanes(df));
  const DepthModel::SinglePrecisionTables& tables = *job.tables;

  const auto v = static_cast<std::size_t>(row);
  const auto row_x = hn::Set(df, tables.row_x[v]);
  const auto row_y = hn::Set(df, tables.row_y[v]);
  const auto row_z = hn::Set(df, tables.row_z[v]);
  const auto camera_x = hn::Set(df, job.camera_x_m);
  const auto camera_y = hn::Set(df, job.camera_y_m);
  const auto camera_z = hn::Set(df, job.camera_z_m);
  const auto ball_x = hn::Set(df, job.ball_x_m);
  const auto ball_y = hn::Set(df, job.ball_y_m);
  const auto ball_z = hn::Set(df, job.ball_z_m);
  const auto radius_squared = hn::Set(df, job.ball_radius_squared_m2);
  const auto voxels_per_m = hn::Set(df, job.voxels_per_m);
  const auto below_first = hn::Set(di, job.window.raw_first - 1);
  const auto above_last = hn::Set(di, job.window.raw_last + 1);
  const auto first_columns = hn::Iota(du, 0);
  const std::uint32_t row_begin = job.points;
  const std::uint16_t* raw_row = job.raw + v * kFrameWidth;

  // Whole vectors from a multiple of the lanes on: 640 is one too, so they end with the row at the latest.
  for (int column = job.window.column_first / lanes * lanes; column <= job.window.column_last;
       column += lanes) {
    const auto u = static_cast<std::size_t>(column);
    const auto raw = hn::PromoteTo(di, hn::LoadU(dr, raw_row + u));
    const auto in_range = hn::And(hn::Gt(raw, below_first), hn::Lt(raw, above_last));
    if (hn::AllFalse(di, in_range)) continue;
    const auto depth =
        hn::GatherIndex(df, tables.depth_m.data(), hn::Min(raw, hn::Set(di, kRawNoMeasurement)));
    const auto x = hn::MulAdd(depth, hn::Add(hn::LoadU(df, tables.column_x.data() + u), row_x), camera_x);
    const auto y = hn::MulAdd(depth, hn::Add(hn::LoadU(df, tables.column_y.data() + u), row_y), camera_y);
    const auto z = hn::MulAdd(depth, hn::Add(hn::LoadU(df, tables.column_z.data() + u), row_z), camera_z);
    const auto from_x = hn::Sub(x, ball_x);
    const auto from_y = hn::Sub(y, ball_y);
    const auto from_z = hn::Sub(z, ball_z);
    const auto distance_squared =
        hn::MulAdd(from_z, from_z, hn::MulAdd(from_y, from_y, hn::Mul(from_x, from_x)));
    const auto keep = hn::And(hn::RebindMask(df, in_range),
                              hn::And(hn::Gt(depth, hn::Zero(df)), hn::Le(distance_squared, radius_squared)));
    const auto kept = static_cast<std::uint32_t>(hn::CountTrue(df, keep));
    if (kept == 0) continue;

    const std::uint32_t begin = job.points;
    const auto cell_x = cellOf(x, voxels_per_m, job.last_cell_x);
    const auto cell_y = cellOf(y, voxels_per_m, job.last_cell_y);
    const auto cell_z = cellOf(z, voxels_per_m, job.last_cell_z);
    const auto grid_row = hn::Add(hn::Mul(cell_z, hn::Set(di, job.cells_y)), cell_y);
    const auto voxel = hn::BitCast(du, hn::Add(hn::Mul(grid_row, hn::Set(di, job.bits_per_row)), cell_x));
    const auto columns = hn::Add(first_columns, hn::Set(du, static_cast<std::uint32_t>(column)));
    const auto pixel = hn::Or(hn::Set(du, PackedPixel::pack(0, static_cast<std::uint32_t>(row), 0)),
                              hn::Or(hn::ShiftLeft<PackedPixel::kRawBits>(columns), hn::BitCast(du, raw)));
    // Compressed in the register and stored whole: compressing into memory is slow on some machines.
    const auto keep_words = hn::RebindMask(du, keep);
    hn::StoreInterleaved4(compress(df, x, keep), compress(df, y, keep), compress(df, z, keep),
                          hn::BitCast(df, compress(du, pixel, keep_words)), df,
                          &job.points_in_image_order[begin].x_m);
    hn::StoreU(compress(du, voxel, keep_words), du, job.voxel_of_row + 1 + begin - row_begin);
    const std::uint32_t taken = std::min(kept, job.point_capacity - begin);
    job.points = begin + taken;
    job.points_over_capacity += kept - taken;
  }
}

/// Starts a run at every point from `first`, the first of its row, on whose voxel differs from that of the
/// point before. Element 0 of voxel_of_row holds the voxel of the last point of the row before.
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
  job.voxel_of_row[0] = job.voxel_of_row[count];
}

void deprojectFrame(DeprojectJob& job) {
  job.points = 0;
  job.points_over_capacity = 0;
  job.run_count = 0;
  job.voxel_of_row[0] = ~0U;  // no voxel: the first point starts a run
  for (int row = job.window.row_first; row <= job.window.row_last; ++row) {
    const std::uint32_t first = job.points;
    deprojectRow(job, row);
    appendRuns(job, first);
  }
  job.run_begin[job.run_count] = job.points;
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
