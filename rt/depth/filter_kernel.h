// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hapticd::rt {

/// Value of a disparity where the sensor measured nothing.
inline constexpr float kNoDisparity = -1;

/// Converts raw values first..last to disparities and all others to kNoDisparity. Both arrays need room for
/// one vector more than `count` elements.  RT: safe after the first call.
void disparityOfRaw(const std::uint16_t* raw, int count, std::uint16_t first, std::uint16_t last,
                    float* disparity) noexcept;

/// Rounds disparities to raw values; kNoDisparity becomes `none`.  RT: safe after the first call.
void rawOfDisparity(const float* disparity, int count, std::uint16_t none, std::uint16_t* raw) noexcept;

/// Conversion of raw values to raw disparities: per_raw raw + per_inverse / raw + offset, rounded.
struct RawConversion {
  std::uint16_t raw_first;  ///< raw values outside raw_first..raw_last have no depth; the others' results are
  std::uint16_t raw_last;   ///< raw disparities
  std::uint16_t none;       ///< result of a raw value without depth
  float per_raw = 0;
  float per_inverse = 0;
  float offset = 0;
};

/// Converts `count` raw values, a multiple of kRowAlignment_px.  RT: safe after the first call.
void convertRaw(const std::uint16_t* raw, int count, const RawConversion& conversion,
                std::uint16_t* disparity) noexcept;

/// State of the temporal mean for a row of pixels; each array has room for one more vector.
struct TemporalRow {
  float* mean;     ///< kNoDisparity: unknown
  float* frames;   ///< number of frames in the mean
  float* missing;  ///< frames since the last measurement
};

/// Largest difference of disparities of one surface, linear in the disparity.
struct Gate {
  float at_zero;
  float per_raw;
};

/// Limits of the temporal mean.
struct TemporalLimits {
  float max_frames;   ///< longest mean, in frames
  Gate gate;          ///< a measurement farther from the mean restarts it
  float hold_frames;  ///< number of frames for which a pixel without measurement keeps its mean
};

/// Sum over pixels of the differences between new measurements and their means.
struct Innovation {
  float sum_raw = 0;
  float pixels = 0;
  float sum_of_gates = 0;  ///< over the same pixels
};

/// Updates the means with a row of new disparities.  RT: safe after the first call.
void updateMeans(const float* disparity, int count, const TemporalLimits& limits, const TemporalRow& row,
                 Innovation& innovation) noexcept;

/// Computes, for `count` pixels, the mean of those of the (2 radius + 1)^2 surrounding pixels that differ
/// from the centre pixel by at most `gate`; kNoDisparity stays. `centre` points to the first pixel of the
/// row; rows are `stride` apart, and the neighbours in all directions must be readable.  RT: safe after the
/// first call.
void meanOfSimilar(const float* centre, int stride, int count, int radius, const Gate& gate,
                   float* out) noexcept;

}  // namespace hapticd::rt
