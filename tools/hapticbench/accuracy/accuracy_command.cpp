// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <limits>

#include "config/error.h"
#include "tools/hapticbench/accuracy/accuracy_report.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

std::vector<std::string> sceneNames() {
  std::vector<std::string> names;
  for (const AccuracyScene& scene : accuracyScenes()) names.push_back(scene.name);
  return names;
}

/// The names of `values`, in their order.
template <typename Values>
std::vector<std::string> namesOf(const Values& values) {
  std::vector<std::string> names;
  for (const auto value : values) names.emplace_back(nameOf(value));
  return names;
}

constexpr std::array<SceneNoise, 4> kAllNoises{SceneNoise::none, SceneNoise::quantised, SceneNoise::sensor,
                                               SceneNoise::harsh};

/// Those of `values` that are named.
template <typename Value, typename Values>
std::vector<Value> chosenOf(const Values& values, const std::vector<std::string>& names) {
  std::vector<Value> chosen;
  for (const Value value : values) {
    if (std::find(names.begin(), names.end(), nameOf(value)) != names.end()) chosen.push_back(value);
  }
  return chosen;
}

}  // namespace

AccuracyCommand::AccuracyCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "accuracy",
          "forces on surfaces that are known: error, direction, pop-through, steps at new frames")) {
  const auto list = [this](const char* option, auto& values, const char* what) {
    return command_->add_option(option, values, what)->delimiter(',');
  };
  list("--scenes", scenes_,
       "of plane, plane30, plane60, sphere, bowl, cylinder, edge, half_plane, corner, plate, "
       "step, moving_0.01, moving_0.1, moving_0.5 (all)")
      ->check(CLI::IsMember(sceneNames()));
  list("--laws", laws_, "of nearest_springs, smooth_springs, proxy, surface (all)")
      ->check(CLI::IsMember(namesOf(kAllLaws)));
  list("--distances", distances_m_, "metres from the camera (0.6,1,2)")->check(within(0.5, 3.9));
  list("--noises", noises_, "of none, quantised, sensor, harsh (none,harsh)")
      ->check(CLI::IsMember(namesOf(kAllNoises)));
  list("--voxels", voxel_edges_mm_, "voxel edges of the grid of points, millimetres: the same forces on each")
      ->check(within(1.0, 100.0));
  list("--filters", filters_, "of the laws on points, of off, on (off,on)")
      ->check(CLI::IsMember({"off", "on"}));
  command_->add_option("--seed", seed_, "of the places and of the noise (1)")
      ->check(within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
  CLI::Option* quick = command_->add_flag("--quick", quick_, "plane and sphere at 1 m, one push each");
  command_->add_flag("--full", full_, "distances 0.6,0.8,1,2,3.5 and grids of 5,20,40 mm")->excludes(quick);
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
}

AccuracyOptions AccuracyCommand::options() const {
  AccuracyOptions options;
  options.seed = seed_;
  if (quick_) {
    options.scenes = {"plane", "sphere"};
    options.distances_m = {1};
    options.pushes = 1;
    options.hold_frames = 10;
  }
  if (full_) {
    options.distances_m = {0.6, 0.8, 1, 2, 3.5};
    options.voxel_edges_m = {0.005, 0.02, 0.04};
  }
  if (!scenes_.empty()) options.scenes = scenes_;
  if (!laws_.empty()) options.laws = chosenOf<rt::ForceLaw>(kAllLaws, laws_);
  if (!distances_m_.empty()) options.distances_m = distances_m_;
  if (!noises_.empty()) options.noises = chosenOf<SceneNoise>(kAllNoises, noises_);
  if (!voxel_edges_mm_.empty()) {
    options.voxel_edges_m.clear();
    for (const double edge_mm : voxel_edges_mm_) options.voxel_edges_m.push_back(edge_mm / 1000);
  }
  if (!filters_.empty()) {
    options.filters.clear();
    for (const std::string& filter : filters_) options.filters.push_back(filter == "on");
  }
  return options;
}

int AccuracyCommand::run() const {
  const bool watched = isatty(STDERR_FILENO) != 0;
  const std::vector<AccuracyRow> rows = measureAccuracy(options(), [watched](const std::string& what) {
    if (watched) fmt::print(stderr, "\r{:<40}", what);
  });
  if (watched) fmt::print(stderr, "\r{:<40}\r", "");
  fmt::print("{}", accuracyTable(rows));
  if (json_file_.empty()) return EX_OK;
  const auto written = writeWholeFile(json_file_, accuracyJson(rows), IfExists::replace);
  if (written) return EX_OK;
  fmt::print(stderr, "hapticbench: {}\n", written.error().text());
  return EX_CANTCREAT;
}

}  // namespace hapticd::tools
