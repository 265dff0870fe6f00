#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/surface_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <cmath>

#include "hwy/highway.h"
#include "rt/depth_frame.h"
#include "rt/surface_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;

/// Adds one row of pixels to the sums of their columns.
HWY_INLINE void addPixelRow(const BlockImage& image, int row) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const float* const pixels = image.disparity +
                              static_cast<std::size_t>(image.row_first + row) * kFrameWidth +
                              static_cast<std::size_t>(image.column_first);
  for (int i = 0; i < image.columns; i += lanes) {
    const auto d = hn::LoadU(df, pixels + i);
    const auto seen = hn::Ge(d, hn::Zero(df));
    hn::StoreU(hn::Add(hn::LoadU(df, image.column_sum + i), hn::IfThenElseZero(seen, d)), df,
               image.column_sum + i);
    hn::StoreU(hn::Add(hn::LoadU(df, image.column_count + i), hn::IfThenElseZero(seen, hn::Set(df, 1.0F))),
               df, image.column_count + i);
  }
}

HWY_INLINE void clearRow(const BlockImage& image, int block_row) {
  const std::size_t begin = image.at(block_row, -1);
  std::fill_n(image.count + begin, image.stride, 0.0F);
  std::fill_n(image.mean + begin, image.stride, 0.0F);
}

void blockMeans(BlockImage& image) {
  clearRow(image, -1);
  clearRow(image, image.block_rows);
  for (int block_row = 0; block_row < image.block_rows; ++block_row) {
    clearRow(image, block_row);
    std::fill_n(image.column_sum, image.columns, 0.0F);
    std::fill_n(image.column_count, image.columns, 0.0F);
    const int row_end = std::min((block_row + 1) * image.block_px, image.rows);
    for (int row = block_row * image.block_px; row < row_end; ++row) addPixelRow(image, row);
    for (int block = 0; block < image.block_columns; ++block) {
      const int begin = block * image.block_px;
      const int end = std::min(begin + image.block_px, image.columns);
      float sum = 0;
      float count = 0;
      for (int i = begin; i < end; ++i) {
        sum += image.column_sum[i];
        count += image.column_count[i];
      }
      const std::size_t index = image.at(block_row, block);
      image.count[index] = count;
      image.mean[index] = count > 0 ? sum / count : 0;
    }
  }
}

/// Least squares of mean = value + slope_u * du + slope_v * dv over the blocks of one surface, a vector of
/// centre blocks at a time. `du` and `dv` are -1, 0 or 1.
struct Plane {
  Floats value, slope_u, slope_v, weight;
};

class PlaneSums {
 public:
  // written out, so that it is compiled for the same instruction set as what it calls
  HWY_INLINE PlaneSums() {
    const FloatTag df;
    s_ = su_ = sv_ = suu_ = suv_ = svv_ = t_ = tu_ = tv_ = hn::Zero(df);
  }

  HWY_INLINE void add(Floats weight, Floats difference, int du, int dv) {
    const FloatTag df;
    const auto weighted = hn::Mul(weight, difference);
    s_ = hn::Add(s_, weight);
    t_ = hn::Add(t_, weighted);
    if (du != 0) {
      const auto sign = hn::Set(df, static_cast<float>(du));
      su_ = hn::MulAdd(weight, sign, su_);
      suu_ = hn::Add(suu_, weight);
      tu_ = hn::MulAdd(weighted, sign, tu_);
    }
    if (dv != 0) {
      const auto sign = hn::Set(df, static_cast<float>(dv));
      sv_ = hn::MulAdd(weight, sign, sv_);
      svv_ = hn::Add(svv_, weight);
      tv_ = hn::MulAdd(weighted, sign, tv_);
    }
    if (du * dv != 0) suv_ = hn::MulAdd(weight, hn::Set(df, static_cast<float>(du * dv)), suv_);
  }

  /// Cramer's rule. The little that is added to the diagonal makes slopes that nothing determines zero.
  HWY_INLINE Plane solve() const {
    const FloatTag df;
    const auto ridge = hn::MulAdd(s_, hn::Set(df, 1e-4F), hn::Set(df, 1e-20F));
    const auto s = hn::Add(s_, hn::Set(df, 1e-20F));
    const auto uu = hn::Add(suu_, ridge);
    const auto vv = hn::Add(svv_, ridge);
    const auto c_ss = hn::NegMulAdd(suv_, suv_, hn::Mul(uu, vv));
    const auto c_su = hn::NegMulAdd(su_, vv, hn::Mul(suv_, sv_));
    const auto c_sv = hn::NegMulAdd(sv_, uu, hn::Mul(su_, suv_));
    const auto determinant = hn::MulAdd(s, c_ss, hn::MulAdd(su_, c_su, hn::Mul(sv_, c_sv)));
    const auto c_uu = hn::NegMulAdd(sv_, sv_, hn::Mul(s, vv));
    const auto c_uv = hn::NegMulAdd(s, suv_, hn::Mul(su_, sv_));
    const auto c_vv = hn::NegMulAdd(su_, su_, hn::Mul(s, uu));
    const auto inverse = hn::Div(hn::Set(df, 1.0F), determinant);
    Plane plane;
    plane.value = hn::Mul(inverse, hn::MulAdd(c_ss, t_, hn::MulAdd(c_su, tu_, hn::Mul(c_sv, tv_))));
    plane.slope_u = hn::Mul(inverse, hn::MulAdd(c_su, t_, hn::MulAdd(c_uu, tu_, hn::Mul(c_uv, tv_))));
    plane.slope_v = hn::Mul(inverse, hn::MulAdd(c_sv, t_, hn::MulAdd(c_uv, tu_, hn::Mul(c_vv, tv_))));
    plane.weight = s_;
    return plane;
  }

 private:
  Floats s_, su_, sv_;
  Floats suu_, suv_, svv_;
  Floats t_, tu_, tv_;
};

/// What the plane is measured from: the block's own mean, or for a hole the mean of its neighbours.
HWY_INLINE Floats referenceOf(const BlockImage& image, std::size_t index) {
  const FloatTag df;
  const auto own_count = hn::LoadU(df, image.count + index);
  const auto has_own = hn::Gt(own_count, hn::Zero(df));
  const auto own_mean = hn::LoadU(df, image.mean + index);
  if (hn::AllTrue(df, has_own)) return own_mean;
  auto sum = hn::Zero(df);
  auto count = hn::Set(df, 1e-20F);
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const std::size_t neighbour =
          static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) + dv * image.stride + du);
      const auto weight = hn::LoadU(df, image.count + neighbour);
      sum = hn::MulAdd(weight, hn::LoadU(df, image.mean + neighbour), sum);
      count = hn::Add(count, weight);
    }
  }
  return hn::IfThenElse(has_own, own_mean, hn::Div(sum, count));
}

HWY_INLINE void storePatches(const BlockImage& image, const PatchFit& fit, int block_row, int block,
                             Floats reference, const Plane& plane) {
  const FloatTag df;
  const std::size_t index = image.at(block_row, block);
  const auto pixels = static_cast<float>(image.block_px * image.block_px);
  const auto own_count = hn::LoadU(df, image.count + index);
  const auto enough_own = hn::Ge(own_count, hn::Set(df, enoughPixels(image)));
  const auto enough_around = hn::Ge(plane.weight, hn::Set(df, 5.5F * pixels));
  const auto closed = hn::Eq(own_count, hn::Set(df, kClosedCount));
  const auto seen = hn::Or(hn::Or(enough_own, enough_around), closed);

  const auto a = hn::Set(df, fit.a_per_m);
  const auto per_px = hn::Set(df, 1 / static_cast<float>(image.block_px));
  const auto w = hn::MulAdd(a, hn::Add(reference, plane.value), hn::Set(df, fit.b_per_m));
  const auto slope_u = hn::Mul(hn::Mul(a, plane.slope_u), per_px);
  const auto slope_v = hn::Mul(hn::Mul(a, plane.slope_v), per_px);
  const float half_px = 0.5F * static_cast<float>(image.block_px - 1);
  const float first_u = static_cast<float>(image.column_first + block * image.block_px) + half_px - fit.cx_px;
  const float v = static_cast<float>(image.row_first + block_row * image.block_px) + half_px - fit.cy_px;
  const auto u =
      hn::MulAdd(hn::Iota(df, 0), hn::Set(df, static_cast<float>(image.block_px)), hn::Set(df, first_u));
  // The plane with 1/Z = w at this pixel and these slopes is N * X = 1 with this N in the camera's frame.
  const auto normal_x = hn::Mul(slope_u, hn::Set(df, fit.fx_px));
  const auto normal_y = hn::Mul(slope_v, hn::Set(df, fit.fy_px));
  const auto normal_z = hn::NegMulAdd(slope_u, u, hn::NegMulAdd(slope_v, hn::Set(df, v), w));
  const auto length_squared =
      hn::MulAdd(normal_x, normal_x, hn::MulAdd(normal_y, normal_y, hn::Mul(normal_z, normal_z)));
  const auto usable = hn::And(seen, hn::Gt(w, hn::Zero(df)));
  const auto distance = hn::IfThenElseZero(usable, hn::Div(hn::Set(df, 1.0F), hn::Sqrt(length_squared)));
  hn::StoreInterleaved4(w, slope_u, slope_v, distance, df, &fit.patch[index].inverse_depth_per_m);
}

void patches(const BlockImage& image, const PatchFit& fit) {
  const FloatTag df;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const auto edge = hn::Set(df, fit.edge_raw);
  for (int block_row = 0; block_row < image.block_rows; ++block_row) {
    for (int block = 0; block < image.block_columns; block += lanes) {
      const std::size_t index = image.at(block_row, block);
      const auto reference = referenceOf(image, index);
      PlaneSums sums;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          const std::size_t neighbour =
              static_cast<std::size_t>(static_cast<std::ptrdiff_t>(index) + dv * image.stride + du);
          const auto difference = hn::Sub(hn::LoadU(df, image.mean + neighbour), reference);
          const auto same_surface = hn::Le(hn::Abs(difference), edge);
          sums.add(hn::IfThenElseZero(same_surface, hn::LoadU(df, image.count + neighbour)), difference, du,
                   dv);
        }
      }
      storePatches(image, fit, block_row, block, reference, sums.solve());
    }
  }
}

/// One row of nodes.
HWY_INLINE void fillRow(const NodeJob& job, int j, int k, float* row) {
  const FloatTag df;
  const IntTag di;
  const auto lanes = static_cast<int>(hn::Lanes(df));
  const BlockImage& image = *job.image;
  const auto truncation = hn::Set(df, job.truncation_m);
  float begin[3];
  for (int axis = 0; axis < 3; ++axis) {
    begin[axis] = job.origin_m[axis] + static_cast<float>(j) * job.step_y_m[axis] +
                  static_cast<float>(k) * job.step_z_m[axis];
  }
  for (int i = 0; i < SurfaceField::kNodesPerAxis; i += lanes) {
    const auto steps = hn::Iota(df, static_cast<float>(i));
    const auto x = hn::MulAdd(steps, hn::Set(df, job.step_x_m[0]), hn::Set(df, begin[0]));
    const auto y = hn::MulAdd(steps, hn::Set(df, job.step_x_m[1]), hn::Set(df, begin[1]));
    const auto depth = hn::Neg(hn::MulAdd(steps, hn::Set(df, job.step_x_m[2]), hn::Set(df, begin[2])));
    constexpr float kNearest_m = 0.01F;  // nearer to the camera's plane, and behind it, nothing is seen
    const auto in_front = hn::Gt(depth, hn::Set(df, kNearest_m));
    const auto per_depth = hn::Div(hn::Set(df, 1.0F), hn::Max(depth, hn::Set(df, kNearest_m)));
    const auto u = hn::MulAdd(hn::Mul(x, per_depth), hn::Set(df, job.fx_px), hn::Set(df, job.cx_px));
    const auto v = hn::NegMulAdd(hn::Mul(y, per_depth), hn::Set(df, job.fy_px), hn::Set(df, job.cy_px));
    const auto per_block = hn::Set(df, 1 / static_cast<float>(image.block_px));
    const auto block_u =
        hn::Mul(hn::Sub(u, hn::Set(df, static_cast<float>(image.column_first) - 0.5F)), per_block);
    const auto block_v =
        hn::Mul(hn::Sub(v, hn::Set(df, static_cast<float>(image.row_first) - 0.5F)), per_block);
    auto inside = hn::And(hn::Ge(block_u, hn::Zero(df)), hn::Ge(block_v, hn::Zero(df)));
    inside = hn::And(inside, hn::Lt(block_u, hn::Set(df, static_cast<float>(image.block_columns))));
    inside = hn::And(inside, hn::Lt(block_v, hn::Set(df, static_cast<float>(image.block_rows))));
    inside = hn::And(inside, in_front);

    const auto column = hn::ConvertTo(di, hn::IfThenElseZero(inside, block_u));
    const auto block_row = hn::ConvertTo(di, hn::IfThenElseZero(inside, block_v));
    const auto one = hn::Set(di, 1);
    const auto index =
        hn::Add(hn::Mul(hn::Add(block_row, one), hn::Set(di, image.stride)), hn::Add(column, one));
    const auto element = hn::ShiftLeft<2>(index);
    const float* const patch = &job.patch->inverse_depth_per_m;
    const auto w = hn::GatherIndex(df, patch, element);
    const auto slope_u = hn::GatherIndex(df, patch + 1, element);
    const auto slope_v = hn::GatherIndex(df, patch + 2, element);
    const auto plane_distance = hn::GatherIndex(df, patch + 3, element);

    // from the middle of the block, in pixels
    const auto block_px = hn::Set(df, static_cast<float>(image.block_px));
    const auto half = hn::Set(df, 0.5F);
    const auto du = hn::Mul(hn::Sub(block_u, hn::Add(hn::ConvertTo(df, column), half)), block_px);
    const auto dv = hn::Mul(hn::Sub(block_v, hn::Add(hn::ConvertTo(df, block_row), half)), block_px);
    const auto w_here = hn::MulAdd(slope_v, dv, hn::MulAdd(slope_u, du, w));
    const auto seen = hn::And(inside, hn::Gt(plane_distance, hn::Zero(df)));
    const auto signed_distance = hn::Mul(hn::NegMulAdd(depth, w_here, hn::Set(df, 1.0F)), plane_distance);
    const auto distance = hn::IfThenElse(seen, signed_distance, truncation);
    hn::StoreU(hn::Max(hn::Neg(truncation), hn::Min(distance, truncation)), df, row + i);
  }
}

void nodes(const NodeJob& job) {
  constexpr int kNodes = SurfaceField::kNodesPerAxis;
  const float radius_squared = job.ball_radius * job.ball_radius;
  for (int k = 0; k < kNodes; ++k) {
    const float dz = static_cast<float>(k) - job.ball_z;
    for (int j = 0; j < kNodes; ++j) {
      const float dy = static_cast<float>(j) - job.ball_y;
      if (dy * dy + dz * dz > radius_squared) continue;
      fillRow(job, j, k, job.distance_m + static_cast<std::size_t>(k * kNodes + j) * kNodes);
    }
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {
namespace {

/// One line of blocks, `step` apart in memory.
struct BlockLine {
  std::size_t first;
  std::size_t step;
  int blocks;
};

/// What may be closed.
struct GapLimits {
  int longest_px;
  float most_raw;
  float most_raw_per_px;
};

/// A block that was closed has this share of a pixel: it shows as a surface, but any measurement beside it
/// rules.
constexpr float kClosedCount = 1e-3F;

void closeGapsOf(const BlockLine& line, const GapLimits& limits, BlockImage& image) noexcept {
  const float enough = enoughPixels(image);
  int last_seen = -1;
  for (int i = 0; i < line.blocks; ++i) {
    const std::size_t here = line.first + static_cast<std::size_t>(i) * line.step;
    if (image.count[here] < enough) continue;
    const int gap = i - last_seen - 1;
    const int before = last_seen;
    last_seen = i;
    const int gap_px = gap * image.block_px;
    if (gap == 0 || before < 0 || gap_px > limits.longest_px) continue;
    const float from = image.mean[line.first + static_cast<std::size_t>(before) * line.step];
    const float change = image.mean[here] - from;
    if (std::abs(change) > limits.most_raw + limits.most_raw_per_px * static_cast<float>(gap_px)) continue;
    for (int k = 1; k <= gap; ++k) {
      const std::size_t hole = line.first + static_cast<std::size_t>(before + k) * line.step;
      const float value = from + change * static_cast<float>(k) / static_cast<float>(gap + 1);
      // closed along the row already: the mean of both
      image.mean[hole] = image.count[hole] == kClosedCount ? 0.5F * (image.mean[hole] + value) : value;
      image.count[hole] = kClosedCount;
    }
  }
}

}  // namespace

void closeGaps(BlockImage& image, int longest_px, float most_raw, float most_raw_per_px) noexcept {
  const GapLimits limits{longest_px, most_raw, most_raw_per_px};
  const auto stride = static_cast<std::size_t>(image.stride);
  for (int row = 0; row < image.block_rows; ++row)
    closeGapsOf({image.at(row, 0), 1, image.block_columns}, limits, image);
  for (int column = 0; column < image.block_columns; ++column) {
    closeGapsOf({image.at(0, column), stride, image.block_rows}, limits, image);
  }
}

HWY_EXPORT(blockMeans);
HWY_EXPORT(patches);
HWY_EXPORT(nodes);

void meanOfBlocks(BlockImage& image) noexcept {
  HWY_DYNAMIC_DISPATCH(blockMeans)(image);
}

void fitPatches(const BlockImage& image, const PatchFit& fit) noexcept {
  HWY_DYNAMIC_DISPATCH(patches)(image, fit);
}

void fillNodes(const NodeJob& job) noexcept {
  HWY_DYNAMIC_DISPATCH(nodes)(job);
}

}  // namespace hapticd::rt
#endif
