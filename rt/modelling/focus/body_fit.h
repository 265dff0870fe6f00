// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt/depth/depth_model.h"
#include "rt/modelling/focus/body_kernel.h"
#include "rt/modelling/focus/corner_fit.h"
#include "rt/modelling/focus/focus_samples.h"
#include "rt/modelling/focus/misfit.h"
#include "rt/scene/disparity_motion.h"
#include "rt/scene/focus_body.h"
#include "rt/scene/focus_corner.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Fits the body that the camera sees at the focus, or the corner where its flat faces meet.
///
/// Windows of growing size around the focus are fitted in turn with a surface of constant curvature, six
/// parameters, by robust Gauss-Newton steps on the pixels' disparities. A wider window counts as far as the
/// mean residuals of its nine cells look like noise, by a continuous weight. Within what the noise leaves
/// open, planes, spheres and cylinders are preferred: the estimate is the mean of the four models weighted by
/// their evidence (Savage and Dickey's ratio: Dickey 1971). Where a body ends in the window in front of
/// something farther, one that is round inside of that outline is a fifth model, with a fit of its own: a rod
/// of 12 pixels differs from a plane by less than the noise of its depths. Windows that are wider than one
/// body explains are fitted with a corner, see CornerFit.
///
/// Thread: one (the scene thread).  RT: safe after the first call.  Cost: bounded, at most eleven fits to
/// FocusSamples::kMax pixels of six passes each; usually one or two of 600 pixels and two passes, four on
/// narrow bodies.
class BodyFit {
 public:
  /// `model` and `column_shift_raw`, see FocusImage, outlive the fit.
  BodyFit(const DepthModel& model, const float* column_shift_raw) noexcept
      : model_(model), column_shift_raw_(column_shift_raw) {}

  /// What a frame shows.
  struct Input {
    const std::uint16_t* image;  ///< raw disparities in frame layout, valid in `pixels`
    PixelWindow pixels;
    ImagePosition focus;
    Facet facet;            ///< the facet at the focus, for the start
    double noise;           ///< see DepthModel::noiseScale()
    DisparityMotion moved;  ///< since the frame before
    double max_frames;      ///< number of frames averaged, at least 1
  };
  /// Returns the body at the focus; `exists` is false if none fits. A body that the frame's pixels agree with
  /// is averaged over the last frames.
  FocusBody fit(const Input& input) noexcept;
  /// Returns the corner at the focus of the last fit; without faces if there is none.
  const FocusCorner& corner() const noexcept { return corner_; }

  /// The next fit starts from its facet.
  void forget() noexcept {
    last_.exists = false;
    corner_fit_.forget();
    corner_ = {};
  }

 private:
  static constexpr std::size_t kWindows = FocusImage::kWindows;

  /// What is known of a window from the frames before.
  struct Window {
    bool tried = false;  ///< in the newest frame
    double frames = 0;   ///< number of frames in the means; 0: none
    FocusBody mean;      ///< of the fits
    FocusBody round;     ///< of those of a round body inside of the outline; `exists`: there is one
    Misfit misfit;       ///< mean
  };

  /// What a fit works on.
  struct Job {
    FocusImage image;
    BodyMeasure measure;
    double prior;  ///< variance of the curvatures
  };
  /// The fit in one window.
  struct Trial {
    FocusBody fitted;  ///< to the newest frame
    FocusBody chosen;  ///< mean over the last frames, with planes, spheres and cylinders preferred
    double agrees;     ///< see Misfit::agreement()
    double radius_px;
    double area_px;  ///< that the body covers
    double covers;   ///< share of the samples that belong to the body
    double loss;     ///< FitSums::loss()
  };

  /// `area_px`: how much of the window the body covers, as far as known.
  Trial tryWindow(const Job& job, const FocusBody& start, double area_px, std::size_t window,
                  bool cold) noexcept;
  /// Returns the plane of the facet.
  FocusBody startOf(const Input& input) const noexcept;
  /// Returns the body of the frame before at the new focus; `exists` is false if there is another one now.
  FocusBody movedTo(const Input& input) const noexcept;
  Job jobFor(const Input& input, double depth_m) const noexcept;
  /// Blends the fits in windows of growing size, the first of which is `base`.
  FocusBody combined(const Job& job, std::span<const Trial> trials, std::size_t base) noexcept;
  /// Moves what is known of the windows to the new focus.
  void moveWindows(const Input& input, bool warm) noexcept;

  const DepthModel& model_;
  const float* column_shift_raw_;
  FocusSamples samples_;

  FocusBody last_;          ///< the fit to the newest frame
  std::size_t window_ = 0;  ///< of last_
  double area_px_ = 0;      ///< of last_ in that window
  std::array<Window, kWindows> windows_;
  CornerFit corner_fit_;
  FocusCorner corner_;
};

}  // namespace hapticd::rt
