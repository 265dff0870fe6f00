// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

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

/// Calls `measure(loop)` for every loop of the choice.
template <typename Measure>
void forEachLoop(const Chosen& chosen, const Measure& measure) {
  const auto has = [](const std::vector<std::string>& names, const std::string& name) {
    return std::ranges::find(names, name) != names.end();
  };
  for (const std::string& wall : chosen.walls) {
    for (const Grip& grip : allGrips()) {
      for (const DeviceKind& device : allDevices()) {
        if (!has(chosen.hands, grip.name) || !has(chosen.devices, device.name)) continue;
        for (const int delay_ticks : chosen.delays_ticks) measure(LoopCase{wall, grip, device, delay_ticks});
      }
    }
  }
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
  command.onRun([chosen](const StudyCommand& self) {
    StabilityResults results;
    forEachLoop(*chosen, [&](const LoopCase& loop) {
      showProgress(fmt::format("{}, {} hand, {}, {} ms", loop.wall, loop.grip.name, loop.device.name,
                               loop.delay_ticks));
      if (!chosen->shipped) results.limits.push_back(findLimit(loop));
      if (loop.wall != "reference") results.defaults.push_back(runDefaults(loop));
    });
    return self.report(stabilityText(results), stabilityJson(results));
  });
  return command;
}

}  // namespace hapticd::tools
