// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/stability_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <algorithm>
#include <cmath>

#include "config/error.h"
#include "tools/hapticbench/stability/plot.h"
#include "tools/hapticbench/stability/stability_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

int fail(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

template <typename Named>
std::vector<std::string> namesOf(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : all) names.push_back(one.name);
  return names;
}

template <typename Named>
std::vector<Named> chosenOf(const std::vector<Named>& all, const std::vector<std::string>& names) {
  std::vector<Named> chosen;
  for (const Named& one : all) {
    if (std::find(names.begin(), names.end(), one.name) != names.end()) chosen.push_back(one);
  }
  return chosen;
}

/// `count` values from `first` to `last`, evenly spaced in their logarithm.
std::vector<double> logSpaced(double first, double last, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(first * std::pow(last / first, i / double(count - 1)));
  return values;
}

/// Nothing to do where no file is wanted.
config::Result<void> write(const std::string& file, const std::string& content) {
  return file.empty() ? config::Result<void>() : writeWholeFile(file, content, IfExists::replace);
}

}  // namespace

StabilityCommand::StabilityCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "stability",
          "closed loop with a simulated device and hand: largest stable stiffness beside the theory")) {
  command_->add_option("--laws", laws_, "reference, nearest_springs, smooth_springs, proxy, surface (all)")
      ->delimiter(',')
      ->check(CLI::IsMember(allWalls()));
  command_->add_option("--hands", hands_, "released, light, damped, firm, heavy (all)")
      ->delimiter(',')
      ->check(CLI::IsMember(namesOf(allGrips())));
  command_
      ->add_option("--devices", devices_,
                   "45g, 100g, 45g-friction, 100g-friction, 45g-encoder, 100g-encoder (all)")
      ->delimiter(',')
      ->check(CLI::IsMember(namesOf(allDevices())));
  command_->add_option("--delays", delays_ticks_, "delays of the force, ms (0,1,2,5,10)")
      ->delimiter(',')
      ->check(within(0, 100));
  command_->add_option("--region-delay", region_delay_ticks_, "delay of the (K, B) region, ms (1)")
      ->check(within(0, 100));
  command_->add_option("--region-hand", region_hand_, "hand of the (K, B) region (light)")
      ->check(CLI::IsMember(namesOf(allGrips())));
  command_->add_option("--region", region_file_, "write the (K, B) region there, tab-separated")
      ->type_name("FILE")
      ->check(endsIn(".tsv"));
  command_->add_option("--plot", plot_file_, "plot the (K, B) region with gnuplot")
      ->type_name("FILE.svg")
      ->check(endsIn(".svg"));
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
  command_->add_flag("--shipped", shipped_, "only the laws as shipped, with the whole safety chain");
  command_->add_flag("--quick", quick_, "one hand, one device, two delays and a coarse region");
}

int StabilityCommand::run() const {
  const auto orAll = [](const auto& names, const auto& all) { return names.empty() ? all : names; };
  const std::vector<std::string> quick_hand{"light"};
  const std::vector<std::string> quick_device{"45g"};
  const auto walls = orAll(laws_, allWalls());
  const auto grips = chosenOf(allGrips(), orAll(hands_, quick_ ? quick_hand : namesOf(allGrips())));
  const auto devices = chosenOf(allDevices(), orAll(devices_, quick_ ? quick_device : namesOf(allDevices())));
  const auto delays =
      orAll(delays_ticks_, quick_ ? std::vector<int>{0, 2} : std::vector<int>{0, 1, 2, 5, 10});
  const LoopCase region{.wall = "",
                        .grip = chosenOf(allGrips(), {region_hand_}).front(),
                        .device = allDevices().front(),
                        .delay_ticks = region_delay_ticks_};
  const auto stiffnesses = logSpaced(100, 10000, quick_ ? 4 : 21);
  const auto dampings =
      quick_ ? std::vector<double>{0, 5} : std::vector<double>{0, 0.5, 1, 2, 4, 7, 10, 15, 20, 30};

  StabilityResults results;
  for (const std::string& wall : walls) {
    for (const Grip& grip : grips) {
      for (const DeviceKind& device : devices) {
        for (const int delay : delays) {
          if (!shipped_) results.limits.push_back(findLimit({wall, grip, device, delay}));
        }
        if (wall == "reference") continue;
        for (const int delay : delays) results.defaults.push_back(runDefaults({wall, grip, device, delay}));
      }
    }
    if (shipped_) continue;
    LoopCase loop = region;
    loop.wall = wall;
    const auto points = mapRegion(loop, stiffnesses, dampings);
    results.region.insert(results.region.end(), points.begin(), points.end());
  }
  fmt::print("{}", stabilityTable(results));

  if (const auto written = write(json_file_, stabilityJson(results)); !written) {
    return fail(written.error(), EX_CANTCREAT);
  }
  if (const auto written = write(region_file_, regionTsv(results.region)); !written) {
    return fail(written.error(), EX_CANTCREAT);
  }
  if (plot_file_.empty()) return EX_OK;
  const std::string title = fmt::format(
      "Stable stiffness and damping: 45 g device, {} hand ({:g} N/m, {:g} N s/m), {} ms delay",
      region.grip.name, region.grip.stiffness_n_per_m, region.grip.damping_n_s_per_m, region.delay_ticks);
  const auto plotted = plotRegion(results.region, title, plot_file_);
  return plotted ? EX_OK : fail(plotted.error(), EX_UNAVAILABLE);
}

}  // namespace hapticd::tools
