// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <vector>

#include "tools/hapticbench/cameras/camera_cost.h"
#include "tools/hapticbench/cameras/camera_error.h"
#include "tools/hapticbench/study_command.h"
#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

struct CamerasOptions {
  int frames = 200;
  int errors = 6;
  std::vector<double> distances_m{0.3, 0.5, 0.7, 1.0, 1.5};
};

const std::vector<Column<CameraCost>>& costColumns() {
  using Row = CameraCost;
  static const std::vector<Column<Row>> all{
      {"/camera", "camera", 0, &Row::camera},
      {"/distance_m", "m", 1, &Row::distance_m},
      {"/pixels_in_reach", "pixels in reach", 0,
       [](const Row& row) { return static_cast<double>(row.pixels_in_reach); }},
      {"/reach_ns", "reach ns", 0, &Row::reach_ns},
      {"/surface_ns", "surface ns", 0, &Row::surface_ns},
      {"/frame_ns", "frame ns", 0, &Row::frame_ns},
      {"/tree_ns", "tree ns", 0, &Row::tree_ns},
      {"/times_cheaper_than_tree", "tree/reach", 0, &Row::timesCheaperThanTree},
      {"/kinect_distance_m", "Kinect at m", 2, &Row::kinect_distance_m},
      {"/reach_per_pixel", "reach per pixel/Kinect", 2, &Row::reachPerPixel},
      {"/surface_per_pixel", "surface per pixel/Kinect", 2, &Row::surfacePerPixel}};
  return all;
}

const std::vector<Column<CameraError>>& errorColumns() {
  using Row = CameraError;
  constexpr double kMillimetres = 1000;
  static const std::vector<Column<Row>> all{{"/camera", "camera", 0, &Row::camera},
                                            {"/distance_m", "m", 2, &Row::distance_m},
                                            {"/law", "law", 0, &Row::law},
                                            {"/sigma_m", "pixel's noise mm", 2, &Row::sigma_m, kMillimetres},
                                            {"/error_m", "error mm", 2, &Row::rms_m, kMillimetres},
                                            {"/plane_sigmas", "planes/noise", 2, &Row::planeSigmas},
                                            {"/ball_sigmas", "ball/noise", 2, &Row::ballSigmas},
                                            {"/expected_m", "expected mm", 2, &Row::expected_m, kMillimetres},
                                            {"/by_expected", "error/expected", 2, &Row::byExpected}};
  return all;
}

const std::vector<Column<NearError>>& nearColumns() {
  using Row = NearError;
  static const std::vector<Column<Row>> all{
      {"/scene", "scene", 0, &Row::scene},
      {"/distance_m", "m", 2, &Row::distance_m},
      {"/error_jnd", "error JND", 2, [](const Row& row) { return row.error_jnd.rms(); }}};
  return all;
}

int run(const CamerasOptions& options, const StudyCommand& self) {
  showProgress("cost");
  const std::vector<CameraCost> costs = measureCameraCosts(options.frames, options.distances_m);
  const CameraErrors errors = measureCameraErrors(options.errors, showProgress);
  std::vector<Requirement> requirements = requirementsOf(costs);
  for (Requirement& requirement : requirementsOf(errors)) requirements.push_back(std::move(requirement));
  const std::string text = "one depth frame modelled, medians\n" + tableText(costColumns(), costs) +
                           "\nerror of the force over the stiffness, RMS\n" +
                           tableText(errorColumns(), errors.rows) + "\nsmall things near a D405\n" +
                           tableText(nearColumns(), errors.near) + "\n" + requirementsText(requirements);
  const Json json{{"frames", options.frames},
                  {"rows", tableJson(costColumns(), costs)},
                  {"errors", tableJson(errorColumns(), errors.rows)},
                  {"near", tableJson(nearColumns(), errors.near)},
                  {"requirements", requirementsJson(requirements)}};
  return self.report(text, json.dump(2) + "\n");
}

}  // namespace

StudyCommand camerasCommand(CLI::App& app) {
  const auto options = std::make_shared<CamerasOptions>();
  StudyCommand command(app, "cameras", "cost of a depth frame and error of the laws with other cameras");
  command.quick("3 frames of each at 0.7 m, and errors with one noise", [options] {
    options->frames = 3;
    options->errors = 1;
    options->distances_m = {0.7};
  });
  command->add_option("--frames", options->frames, "number of timed frames of each camera (200)")
      ->check(within(3, 100'000));
  command->add_option("--errors", options->errors, "number of noises that errors are averaged over (6)")
      ->check(within(1, 1000));
  command.json();
  command.onRun([options](const StudyCommand& self) { return run(*options, self); });
  return command;
}

}  // namespace hapticd::tools
