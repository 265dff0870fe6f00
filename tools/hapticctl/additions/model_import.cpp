// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/addition_options.h"

#include <fmt/format.h>

#include "config/base/whole_file.h"
#include "tools/hapticctl/additions/handle_touch.h"
#include "tools/hapticctl/additions/markups.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/registration/model_registration.h"

namespace hapticd::tools {
namespace {

using base::Error;
using Landmarks = std::vector<PlacedLandmark>;

constexpr const char* kCommand = "import";

std::expected<ModelLandmarks, int> landmarksIn(const CommandOptions& options, const std::string& file,
                                               Json& document) {
  if (isMarkupFile(file)) {
    auto landmarks = landmarksOfMarkups(file);
    if (!landmarks) return std::unexpected(report(landmarks.error(), options.json));
    tell(options, landmarks->notes, document);
    return std::move(*landmarks);
  }
  const auto content = contentOf(options, file);
  if (!content) return std::unexpected(content.error());
  auto landmarks = landmarksFromText(*content, file);
  if (!landmarks) return std::unexpected(report(landmarks.error(), options.json));
  return ModelLandmarks{.landmarks = std::move(*landmarks)};
}

/// The landmarks of a model at their places in the world, without those that the person leaves out.
std::expected<Landmarks, int> touched(const CommandOptions& options, const Landmarks& model) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(report(client.error(), options.json));
  Landmarks measured;
  for (const PlacedLandmark& landmark : model) {
    const auto place =
        touch({*client, kCommand, options.json}, fmt::format("'{}'", printable(landmark.name)), true);
    if (!place) return std::unexpected(place.error());
    if (*place) measured.push_back({landmark.name, **place});
  }
  return measured;
}

std::expected<Landmarks, int> measuredFor(const CommandOptions& options, const ModelOptions& requested,
                                          const ModelLandmarks& model, Json& document) {
  if (!requested.measured.empty()) {
    auto in_file = landmarksIn(options, requested.measured, document);
    if (!in_file) return std::unexpected(in_file.error());
    std::erase_if(in_file->landmarks,
                  [&](const PlacedLandmark& landmark) { return model.unplaced.contains(landmark.name); });
    return std::move(in_file->landmarks);
  }
  auto measured = touched(options, model.landmarks);
  if (!measured || requested.save.empty()) return measured;
  if (const auto written = base::writeWholeFile(requested.save, textOf(*measured), base::IfExists::refuse);
      !written)
    return std::unexpected(report(written.error(), options.json));
  return measured;
}

void addFit(const std::vector<PointPair>& pairs, const RigidFit& fit, const config::SceneAdditions& additions,
            Json& document) {
  Json landmarks = Json::array();
  for (std::size_t i = 0; i < pairs.size(); ++i)
    landmarks.push_back({{"name", pairs[i].name}, {"residualM", fit.residuals_m[i]}});
  document.update({{"landmarks", std::move(landmarks)}, {"rmsM", fit.rms_m}, {"largestM", fit.largest_m}});
  if (const auto centre = centreOf(additions))
    document["expectedErrorM"] = expectedTargetError_m(pairs, fit.rms_m, *centre);
}

void show(const Json& document) {
  const auto line = [](const std::string& name, double metres) {
    fmt::print("  {:<30} {:>7} mm\n", name, fixed(1000 * metres, 2));
  };
  fmt::print("residuals of the landmarks\n");
  for (const Json& landmark : document["landmarks"])
    line(textAt(landmark, "name"), numberAt(landmark, "residualM"));
  line("root mean square", numberAt(document, "rmsM"));
  if (document.contains("expectedErrorM"))
    line("expected error at the centre", numberAt(document, "expectedErrorM"));
}

}  // namespace

void addModelOptions(CLI::App& command, const std::shared_ptr<ModelOptions>& requested) {
  auto* landmarks =
      command
          .add_option(
              "--landmarks", requested->landmarks,
              "The file is in the frame of a model with these landmarks, each of which is then touched "
              "with the handle; YAML: 'landmarks: [{name: tip, position_m: [0, 0, 0]}]', may be in the "
              "same file; or a point list of 3D Slicer (.mrk.json, .fcsv)")
          ->type_name("FILE");
  auto* measured = command
                       .add_option("--measured", requested->measured,
                                   "Take the places of the landmarks in the world from this file of the same "
                                   "form instead of touching them")
                       ->type_name("FILE")
                       ->needs(landmarks);
  command.add_option("--save-measured", requested->save, "Write the touched places to a file for --measured")
      ->type_name("FILE")
      ->needs(landmarks)
      ->excludes(measured);
  command
      .add_option("--most-residual-m", requested->most_residual_m,
                  "Refuse a registration that leaves a landmark farther off than this (default 0.005)")
      ->type_name("M")
      ->check(within(0.0, 1.0))
      ->needs(landmarks);
}

std::expected<config::SceneAdditions, int> registered(const CommandOptions& options,
                                                      const ModelOptions& requested,
                                                      const config::SceneAdditions& of_model,
                                                      Json& document) {
  const auto model = landmarksIn(options, requested.landmarks, document);
  if (!model) return std::unexpected(model.error());
  const auto measured = measuredFor(options, requested, *model, document);
  if (!measured) return std::unexpected(measured.error());
  const auto pairs = pairsOf(model->landmarks, *measured);
  if (!pairs) return std::unexpected(report(pairs.error(), options.json));
  const auto fit = fitRigid(*pairs, "model's");
  if (!fit) return std::unexpected(report(fit.error(), options.json));
  auto moved = movedToWorld(of_model, fit->T_world_camera);
  if (!moved) return std::unexpected(report(moved.error(), options.json));
  addFit(*pairs, *fit, *moved, document);
  if (!options.json) show(document);
  if (fit->largest_m > requested.most_residual_m) {
    return std::unexpected(
        report(Error{kCommand,
                     fmt::format("nothing was changed: a landmark is off by {:.1f} mm, at most {:.1f} mm are "
                                 "allowed",
                                 1000 * fit->largest_m, 1000 * requested.most_residual_m),
                     "measure the worst landmark again, or --most-residual-m"},
               options.json));
  }
  return std::move(*moved);
}

}  // namespace hapticd::tools
