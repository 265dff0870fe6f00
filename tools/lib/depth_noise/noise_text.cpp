// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/depth_noise/noise_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

/// Largest value that the configuration takes.
constexpr double kMaxCorrelation_px = 32;

}  // namespace

std::string textOf(const DepthNoiseReport& report, rt::DepthPrinciple principle) {
  if (report.at_depths.empty())
    return "noise        not measured: too few frames, or nothing within camera.near_m and camera.far_m\n";
  std::string text = "noise        depth_m  changing_mm  standing_mm  pixels\n";
  for (const NoiseAtDepth& at : report.at_depths) {
    text += fmt::format("             {:>7.3f}  {:>11.3f}  {:>11.3f}  {:>6}\n", at.depth_m,
                        at.changing_m * 1e3, at.standing_m * 1e3, at.pixels);
  }
  const auto fit = fittedNoise(report.at_depths, principle);
  if (!fit) return text;
  text += fmt::format("correlation  {:.1f} px\nstanding     {:.0f} % of the variance\n",
                      report.correlation_px, 100 * fit->standing_share);
  return text + fmt::format(
                    "\ncamera:\n  noise_c0_m: {:.6f}\n  noise_c1: {:.6f}\n  noise_c2_per_m: {:.6f}\n"
                    "  noise_standing_share: {:.2f}\n  noise_correlation_px: {:.1f}\n",
                    fit->c0_m, fit->c1, fit->c2_per_m, fit->standing_share,
                    std::clamp(report.correlation_px, 1.0, kMaxCorrelation_px));
}

void addTo(nlohmann::ordered_json& document, const DepthNoiseReport& report, rt::DepthPrinciple principle) {
  using Json = nlohmann::ordered_json;
  Json& depths = document["noiseAtDepths"] = Json::array();
  for (const NoiseAtDepth& at : report.at_depths) {
    depths.push_back({{"depthM", at.depth_m},
                      {"changingM", at.changing_m},
                      {"standingM", at.standing_m},
                      {"pixels", at.pixels}});
  }
  const auto fit = fittedNoise(report.at_depths, principle);
  document["noise"] = fit ? Json{{"c0M", fit->c0_m},
                                 {"c1", fit->c1},
                                 {"c2PerM", fit->c2_per_m},
                                 {"standingShare", fit->standing_share},
                                 {"correlationPx", report.correlation_px}}
                          : Json();
}

}  // namespace hapticd::tools
