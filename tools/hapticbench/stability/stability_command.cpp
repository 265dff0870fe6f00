// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/stability_report.h"
#include "tools/hapticbench/study_command.h"

namespace hapticd::tools {
namespace {

struct Chosen {
  std::vector<std::string> walls = allWalls();
  std::vector<std::string> hands = namesOf(allGrips());
  std::vector<std::string> devices = namesOf(allDevices());
  std::vector<int> delays_ticks{0, 1, 2, 5, 10};
  bool shipped = false;
};

std::vector<LoopCase> loopsOf(const Chosen& chosen) {
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  std::vector<LoopCase> loops;
  for (const std::string& wall : chosen.walls) {
    for (const Grip& grip : allGrips()) {
      for (const DeviceKind& device : allDevices()) {
        if (!has(chosen.hands, grip.name) || !has(chosen.devices, device.name)) continue;
        for (const int delay_ticks : chosen.delays_ticks) loops.push_back({wall, grip, device, delay_ticks});
      }
    }
  }
  return loops;
}

/// What is measured of one loop.
struct LoopResults {
  std::optional<LoopLimit> limit;
  std::optional<DefaultRun> defaults;
};
auto fieldsOf(Is<LoopResults> auto& results) {
  auto& [limit, defaults] = results;
  return std::tie(limit, defaults);
}

LoopResults measure(const LoopCase& loop, bool only_shipped) {
  LoopResults results;
  if (!only_shipped) results.limit = findLimit(loop);
  if (loop.wall != "reference") results.defaults = runDefaults(loop);
  return results;
}

StabilityResults together(const std::vector<LoopResults>& loops) {
  StabilityResults all;
  for (const LoopResults& loop : loops) {
    if (loop.limit) all.limits.push_back(*loop.limit);
    if (loop.defaults) all.defaults.push_back(*loop.defaults);
  }
  return all;
}

}  // namespace

StudyCommand stabilityCommand(CLI::App& app) {
  const auto chosen = std::make_shared<Chosen>();
  StudyCommand command(
      app, "stability",
      "closed loop with a simulated device and hand: largest stable stiffness beside the theory");
  command.quick("one hand, one device and two delays", [chosen] {
    chosen->hands = {"light"};
    chosen->devices = {"45g"};
    chosen->delays_ticks = {0, 2};
  });
  command.names("--laws", chosen->walls, allWalls(), "all");
  command.names("--hands", chosen->hands, namesOf(allGrips()), "all");
  command.names("--devices", chosen->devices, namesOf(allDevices()), "all");
  command.numbers("--delays", chosen->delays_ticks, 0, 100, "delays of the force, ms (0,1,2,5,10)");
  command->add_flag("--shipped", chosen->shipped, "only the laws as shipped, with the whole safety chain");
  command.json();
  command.parts();
  command.onRun([chosen](const StudyCommand& self) {
    return self.forEachCase(
        loopsOf(*chosen), [&](const LoopCase& loop) { return measure(loop, chosen->shipped); },
        [&self](const std::vector<LoopResults>& loops) {
          const StabilityResults results = together(loops);
          return self.report(stabilityText(results), stabilityJson(results));
        });
  });
  return command;
}

}  // namespace hapticd::tools
