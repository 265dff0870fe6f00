// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/strokes/strokes_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "config/error.h"
#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/strokes/strokes_report.h"
#include "tools/hapticbench/strokes/strokes_requirements.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

constexpr SceneNoise kStrokeNoises[] = {SceneNoise::none, SceneNoise::quantised, SceneNoise::sensor,
                                        SceneNoise::harsh};

std::vector<std::string> strokeSceneNames() {
  std::vector<std::string> names;
  for (const StrokeScene& scene : strokeScenes()) names.push_back(scene.name);
  return names;
}

std::vector<std::string> strokeNoiseNames() {
  std::vector<std::string> names;
  for (const SceneNoise noise : kStrokeNoises) names.emplace_back(nameOf(noise));
  return names;
}

}  // namespace

StrokesCommand::StrokesCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "strokes",
          "strokes over bodies that are known: error, lost contact, lag, forces that nothing explains")) {
  const auto list = [this](const char* option, auto& values, const std::string& what) {
    return command_->add_option(option, values, what)->delimiter(',');
  };
  list("--laws", laws_, "of nearest_springs, smooth_springs, proxy, surface, auto (proxy,surface,auto)")
      ->check(CLI::IsMember(strokeLaws()));
  list("--scenes", scenes_, fmt::format("of {} (all)", fmt::join(strokeSceneNames(), ", ")))
      ->check(CLI::IsMember(strokeSceneNames()).description(""));  // the text names them already
  list("--distances", distances_m_, "metres from the camera (0.6,1,2)")->check(within(0.45, 3.5));
  list("--noises", noises_, fmt::format("of {} (none,sensor,harsh)", fmt::join(strokeNoiseNames(), ", ")))
      ->check(CLI::IsMember(strokeNoiseNames()));
  command_->add_option("--depth", depth_mm_, "of the strokes below the surface, millimetres (8)")
      ->check(within(1.0, 40.0));
  command_
      ->add_option("--latency", latency_ms_, "of the camera, as camera.latency_s knows it, milliseconds (0)")
      ->check(within(0.0, 200.0));
  command_->add_option("--repeats", repeats_, "of each stroke, at other places and with other noise (1)")
      ->check(within(1, 1000));
  command_
      ->add_option("--count", count_,
                   "so many strokes instead, each over a random smooth scene at a random distance")
      ->check(within(1, 100000));
  command_->add_option("--seed", seed_, "of the places and of the noise (1)")
      ->check(within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
  CLI::Option* quick =
      command_->add_flag("--quick", quick_, "one stroke each over a plane, a rod and an edge at 1 m");
  command_->add_flag("--full", full_, "distances 0.45,0.6,1,1.5,2,3")->excludes(quick);
  command_->add_flag("--each", each_, "one row for each stroke of a scene");
  command_->add_flag("--check", check_, "exit status 1 where a bound is not kept");
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
}

StrokesOptions StrokesCommand::options() const {
  StrokesOptions options;
  options.seed = seed_;
  options.depth_m = depth_mm_ / 1000;
  options.latency_s = latency_ms_ / 1000;
  options.repeats = repeats_;
  options.each = each_;
  if (quick_) {
    options.scenes = {"plane0", "rod40", "over_edge"};
    options.distances_m = {1};
    options.variants = 1;
  }
  if (full_) options.distances_m = {0.45, 0.6, 1, 1.5, 2, 3};
  if (!laws_.empty()) options.laws = laws_;
  if (!scenes_.empty()) options.scenes = scenes_;
  if (!distances_m_.empty()) options.distances_m = distances_m_;
  if (!noises_.empty()) {
    options.noises.clear();
    for (const SceneNoise noise : kStrokeNoises) {
      if (std::ranges::find(noises_, nameOf(noise)) != noises_.end()) options.noises.push_back(noise);
    }
  }
  return options;
}

int StrokesCommand::run() const {
  const bool watched = isatty(STDERR_FILENO) != 0;
  const auto progress = [watched](const std::string& what) {
    if (watched) fmt::print(stderr, "\r{:<40}", what);
  };
  const std::vector<StrokesRow> rows =
      count_ > 0 ? measureRandomStrokes(options(), count_, progress) : measureStrokes(options(), progress);
  if (watched) fmt::print(stderr, "\r{:<40}\r", "");
  fmt::print("{}", strokesTable(rows));
  if (!json_file_.empty()) {
    const auto written = writeWholeFile(json_file_, strokesJson(rows), IfExists::replace);
    if (!written) {
      fmt::print(stderr, "hapticbench: {}\n", written.error().text());
      return EX_CANTCREAT;
    }
  }
  const bool kept = std::ranges::all_of(strokesRequirements(rows),
                                        [](const StrokesRequirement& one) { return one.violated == 0; });
  return check_ && !kept ? EXIT_FAILURE : EX_OK;
}

}  // namespace hapticd::tools
