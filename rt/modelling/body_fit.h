// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/depth/depth_model.h"
#include "rt/modelling/block_image.h"
#include "rt/modelling/body_kernel.h"
#include "rt/modelling/column_shifts.h"
#include "rt/scene/focus_body.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Fits the body that the camera sees at the focus.
///
/// Windows of growing size around the focus are fitted in turn with a surface of constant curvature, six
/// parameters, by robust Gauss-Newton steps on the pixels' disparities. A wider window counts as far as the
/// mean residuals of its nine cells look like noise, by a continuous weight. Within what the noise leaves
/// open, planes, spheres and cylinders are preferred: the estimate is the mean of the four models weighted by
/// their evidence (Savage and Dickey's ratio: Dickey 1971).
///
/// Thread: one (the scene thread).  RT: safe after the first call.  Cost: bounded, at most kWindows windows of
/// BodySamples::kMax pixels and kSteps steps each.
class BodyFit {
 public:
  /// `model` and `shifts` outlive the fit.
  BodyFit(const DepthModel& model, const ColumnShifts& shifts) noexcept : model_(model), shifts_(shifts) {}

  /// Returns the body at an image position; `exists` is false if none fits. `image`: raw disparities in frame
  /// layout, valid in `pixels`. `facet` is the facet at the focus, for the start. `noise`: see
  /// DepthModel::noiseScale().
  FocusBody fit(const std::uint16_t* image, const PixelWindow& pixels, const ImagePosition& focus,
                const Facet& facet, double noise) noexcept;

  /// The next fit starts from its facet.
  void forget() noexcept { last_.exists = false; }

 private:
  /// Half the sides of the windows.
  static constexpr std::array kRadius_m{0.014, 0.022, 0.034, 0.052, 0.08};

  /// What a fit works on.
  struct Job {
    const std::uint16_t* image;
    PixelWindow pixels;
    BodyMeasure measure;
    double sigma_raw;  ///< standard deviation of a pixel
    double unit_m;     ///< depth of a raw unit
    double px_per_m;
    double per_m;  ///< inverse depth
    double prior;  ///< variance of the curvatures
  };
  /// The fit in one window.
  struct Trial {
    FocusBody fitted;
    FocusBody chosen;  ///< `fitted` with planes, spheres and cylinders preferred
    double agrees;     ///< 0: the pixels are not of one body; 1: the residuals look like noise
    double radius_px;
  };

  static double priorAt(double depth_m) noexcept;
  Trial tryWindow(const Job& job, const FocusBody& start, std::size_t window, bool cold) noexcept;
  FocusBody startOf(const ImagePosition& focus, const Facet& facet) const noexcept;
  bool collect(const Job& job, const FocusBody& body, double radius_px) noexcept;

  const DepthModel& model_;
  const ColumnShifts& shifts_;
  BodySamples samples_;
  FocusBody last_;
  std::size_t window_ = 0;  ///< of last_
};

}  // namespace hapticd::rt
