// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <vector>

#include "tools/hapticbench/cameras/camera_cost.h"
#include "tools/hapticbench/study_command.h"
#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

const std::vector<Column<CameraCost>>& columns() {
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

}  // namespace

StudyCommand camerasCommand(CLI::App& app) {
  const auto repetitions = std::make_shared<int>(200);
  StudyCommand command(app, "cameras", "what a depth frame costs with cameras of other sizes");
  const auto distances_m = std::make_shared<std::vector<double>>(std::vector{0.3, 0.5, 0.7, 1.0, 1.5});
  command.quick("3 frames of each, at 0.7 m only", [repetitions, distances_m] {
    *repetitions = 3;
    *distances_m = {0.7};
  });
  command->add_option("--frames", *repetitions, "number of frames of each camera (200)")
      ->check(within(3, 100'000));
  command.json();
  command.onRun([repetitions, distances_m](const StudyCommand& self) {
    const std::vector<CameraCost> costs = measureCameraCosts(*repetitions, *distances_m);
    return self.report("one depth frame modelled, medians\n" + tableText(columns(), costs),
                       Json{{"frames", *repetitions}, {"rows", tableJson(columns(), costs)}}.dump(2) + "\n");
  });
  return command;
}

}  // namespace hapticd::tools
