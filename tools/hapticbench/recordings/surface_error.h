// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "tools/hapticbench/recordings/session.h"
#include "tools/hapticbench/recordings/surface_stroke.h"

namespace hapticd::tools {

/// Errors of a law while a hand is on a known surface; only ticks at full depth count.
struct SurfaceError {
  std::vector<double> error_n;      ///< against the true force
  std::vector<double> along_n;      ///< along the stroke, of either sign
  std::vector<double> new_frame_n;  ///< change of the law's force at a new frame, HIP still
  std::size_t lost = 0;             ///< ticks with less than a tenth of the true force
  std::size_t zero = 0;             ///< of these, with no force at all
  double largest_true_n = 0;        ///< true force

  void add(const SurfaceError& other);
};

/// Compares the law's forces, tick by tick, with the true ones. `forces_n` and `new_frame` are as long as
/// `ticks`.
SurfaceError judgeSurface(std::span<const StrokeTick> ticks, std::span<const rt::Vec3> forces_n,
                          const std::vector<bool>& new_frame);

/// The errors of one law on one surface of a session.
SurfaceError handleWith(const std::string& law, const BenchSequence& session, const RestingSurface& surface,
                        const CameraDisparity& camera, Handling handling);

}  // namespace hapticd::tools
