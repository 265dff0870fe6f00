// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/settings/settings.h"
#include "rt/base/parameters.h"

namespace hapticd::config {

/// Size of the frames of a camera.
struct FrameSize {
  int width_px;
  int height_px;
};

/// Returns the configured size of the frames, and what of it is left open from the usual one of the camera.
constexpr FrameSize sizeOf(const DepthFormat& configured, FrameSize usual) {
  return {configured.width_px > 0 ? configured.width_px : usual.width_px,
          configured.height_px > 0 ? configured.height_px : usual.height_px};
}

/// Depth unit that cameras are set to where nothing else is configured and the range allows it.
inline constexpr double kFineUnit_m = 1e-4;

/// Horizontal field of view and baseline of a RealSense D435, from its data sheet.
inline constexpr double kD435FieldOfView_deg = 90;
inline constexpr double kD435Baseline_m = 0.05;
/// Frames of a RealSense D400 in its usual mode.
inline constexpr FrameSize kStereoSize{848, 480};
/// Frames of a Femto Mega in its narrow, unbinned mode.
inline constexpr FrameSize kFlightSize{640, 576};

/// Returns the noise of a stereo camera on a surface with texture, c2 of rt::DepthNoiseParameters, in 1/m: s
/// / (f b) with a subpixel error s of 0.08 px.
double stereoNoise_per_m(double focal_px, double baseline_m);

/// Returns the usual stereo camera that delivers depth in millimetres: focal length from the horizontal field
/// of view, noise of stereoNoise_per_m(). Near and far limit are the defaults.
rt::DepthModelParameters stereoCamera(FrameSize size, double field_of_view_deg, double baseline_m);

/// Returns the usual time-of-flight camera that delivers depth in millimetres; its noise grows linearly. Near
/// and far limit are the defaults.
rt::DepthModelParameters timeOfFlightCamera(FrameSize size);

}  // namespace hapticd::config
