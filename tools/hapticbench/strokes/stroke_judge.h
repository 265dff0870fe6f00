// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/strokes/stroke_run.h"

namespace hapticd::tools {

/// The limits that a stroke is judged by.
struct JudgeLimits {
  double lag_m = 0.005;     ///< the largest lag of the proxy: 5 mm or two pixel pitches, whichever is larger
  double end_m = 0;         ///< ticks that near to the end of the body are judged by where the contact ends
  double pitch_m = 0.0015;  ///< of the pixels along the stroke
  double clear_m = 0.002;   ///< a HIP farther than that from every body touches nothing
  bool has_proxy = true;
};

/// Where contacts ended, metres beyond the end of the body: the range over several strokes.
struct EndSpread {
  int ends = 0;
  double earliest_m = 0;
  double latest_m = 0;
  double worst_pitches = 0;  ///< largest distance in pixel pitches along the stroke

  void add(double past_end_m, double pitch_m);
  void add(const EndSpread& other);
};

/// The figures of a law on strokes. Judged ticks in which the true force is not zero are "contact ticks",
/// those of a HIP that touches nothing are "free ticks".
struct StrokeFigures {
  int strokes = 0;
  int stopped = 0;  ///< the proxy fell behind by more than the limit and never came back
  int lagged = 0;   ///< it did at some tick
  long contact_ticks = 0;
  long lost_ticks = 0;        ///< truth above 0.5 N, force below 0.1 N
  long wrong_side_ticks = 0;  ///< force into the body, more than 0.1 N where the truth is above 0.5 N
  long free_ticks = 0;
  long ghost_ticks = 0;  ///< force above 0.1 N on a HIP that touches nothing
  long outside_model_ticks = 0;
  ForceErrors error;    ///< of the law's force
  ForceErrors blended;  ///< of the force after the blend
  Spread along_n;       ///< the error's component along the stroke
  Spread normal_n;      ///< the error's component along the true normal
  double lag_m = 0;     ///< largest
  double ghost_n = 0;   ///< largest force on a HIP that touches nothing
  EndSpread end;

  void add(const StrokeFigures& other);
  double lostPercent() const;
  double ghostPercent() const;
  double wrongSidePercent() const;
};

/// Judges one stroke. Both series have the same length.
StrokeFigures judgeStroke(const std::vector<TrueTick>& truth, const std::vector<LawTick>& output,
                          const JudgeLimits& limits);

}  // namespace hapticd::tools
