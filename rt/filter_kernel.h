// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hapticd::rt {

/// What a disparity is where the sensor measured nothing.
inline constexpr float kNoDisparity = -1;

/// Raw values first..last become disparities, all others kNoDisparity. Arrays have room for a vector more
/// than `count`.  RT: safe after the first call.
void disparityOfRaw(const std::uint16_t* raw, int count, std::uint16_t first, std::uint16_t last,
                    float* disparity) noexcept;

/// Disparities become raw values, to the nearest; kNoDisparity becomes `none`.  RT: safe after the first
/// call.
void rawOfDisparity(const float* disparity, int count, std::uint16_t none, std::uint16_t* raw) noexcept;

/// Memory of the temporal mean, for a row of pixels; each array has room for a vector more.
struct TemporalRow {
  float* mean;     ///< kNoDisparity: nothing known
  float* frames;   ///< that the mean is over
  float* missing;  ///< frames since the last measurement
};

struct TemporalLimits {
  float most_frames;  ///< that a mean is over
  float gate_raw;     ///< a measurement farther from the mean starts a new one
  float hold_frames;  ///< that a pixel without measurement keeps its mean
};

/// How far new measurements were from their means, summed over pixels.
struct Innovation {
  float sum_raw = 0;
  float pixels = 0;
};

/// Takes a row of new disparities into the means.  RT: safe after the first call.
void updateMeans(const float* disparity, int count, const TemporalLimits& limits, const TemporalRow& row,
                 Innovation& innovation) noexcept;

/// For `count` pixels: the mean of those of the (2 radius + 1)^2 pixels around each that differ by no more
/// than `gate_raw` from it; kNoDisparity stays. `centre` is the first pixel of the row; the rows above and
/// below, and the pixels before and after, can be read. Rows are `stride` apart.  RT: safe after the first
/// call.
void meanOfSimilar(const float* centre, int stride, int count, int radius, float gate_raw,
                   float* out) noexcept;

}  // namespace hapticd::rt
