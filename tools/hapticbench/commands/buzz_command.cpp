// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "tools/hapticbench/buzz.h"
#include "tools/hapticbench/engine/study.h"

namespace hapticd::tools {
namespace {

struct BuzzOptions {
  std::vector<std::string> laws{"auto"};
  std::vector<double> distances_m{0.6, 1, 1.2};
  std::vector<BuzzHand> hands{kBuzzHands.begin(), kBuzzHands.end()};
  std::vector<BuzzScene> scenes{kBuzzScenes.begin(), kBuzzScenes.end()};
  std::vector<BuzzWithout> without{kBuzzCauses.begin(), kBuzzCauses.end()};
  std::uint32_t seed = 1;
};

struct BuzzRow {
  BuzzCase buzz;
  BuzzResult result;
};

std::vector<BuzzRow> measureBuzz(const BuzzOptions& options) {
  std::vector<BuzzRow> rows;
  BuzzCase one{.seed = options.seed};
  for (const std::string& law : options.laws) {
    one.law = law;
    for (const double distance_m : options.distances_m) {
      one.distance_m = distance_m;
      for (const BuzzHand hand : options.hands) {
        one.hand = hand;
        for (const BuzzScene scene : options.scenes) {
          one.scene = scene;
          for (const BuzzWithout without : options.without) {
            one.without = without;
            if (without == BuzzWithout::frames && scene != BuzzScene::still) continue;
            showProgress(fmt::format("{} at {} m, without {}", law, distance_m, nameOf(without)));
            rows.push_back({one, runBuzz(one)});
          }
        }
      }
    }
  }
  return rows;
}

constexpr const char* kExplanation =
    "A simulated device of 45 g (encoder 50 um, friction 0.05 N) in a hand, about 4 mm deep in a plane with "
    "the\n"
    "harsher noise, still and stroking at 0.1 m/s; breathing: 20 mm, 0.25 Hz. The command behind the whole\n"
    "safety chain from 60 to 500 Hz (Welch, Hann window, 1024 ms): RMS, and amplitude of the largest line.\n"
    "without: what is left out, to show what causes it; frames: the picture stands still.\n\n";

Columns<BuzzRow> columns() {
  using Row = BuzzRow;
  return {{"/law", "law", 0, [](const Row& r) { return r.buzz.law; }},
          {"/distance_m", "m", 2, [](const Row& r) { return r.buzz.distance_m; }},
          {"/hand", "hand", 0, [](const Row& r) { return nameOf(r.buzz.hand); }},
          {"/scene", "scene", 0, [](const Row& r) { return nameOf(r.buzz.scene); }},
          {"/without", "without", 0, [](const Row& r) { return nameOf(r.buzz.without); }},
          {"/rms_n", "RMS mN", 1, [](const Row& r) { return r.result.rms_n; }, 1000},
          {"/line_n", "line mN", 1, [](const Row& r) { return r.result.line_n; }, 1000},
          {"/line_hz", "at Hz", 0, [](const Row& r) { return r.result.line_hz; }},
          {"/mean_force_n", "force N", 2, [](const Row& r) { return r.result.mean_force_n; }}};
}

const std::vector<RowRequirement<BuzzRow>>& rowRequirements() {
  static const std::vector<RowRequirement<BuzzRow>> all{
      {"vibration of the command, 60 to 500 Hz, to 1.2 m, mN RMS",
       [](const BuzzRow& r) { return figureIf(r.buzz.distance_m <= 1.2, 1000 * r.result.rms_n, 10); }},
      {"its largest line, mN",
       [](const BuzzRow& r) { return figureIf(r.buzz.distance_m <= 1.2, 1000 * r.result.line_n, 5); }},
  };
  return all;
}

std::vector<Requirement> requirementsOf(const std::vector<BuzzRow>& rows,
                                        const std::vector<std::string>& laws) {
  std::vector<Requirement> list;
  for (const std::string& law : laws) {
    const auto as_shipped = [&law](const BuzzRow& row) {
      return row.buzz.law == law && row.buzz.without == BuzzWithout::nothing;
    };
    const auto describe = [](const BuzzRow& row) {
      return fmt::format("{:g} m, hand {}, scene {}", row.buzz.distance_m, nameOf(row.buzz.hand),
                         nameOf(row.buzz.scene));
    };
    for (const auto& requirement : rowRequirements())
      list.push_back(checked(law, requirement, rows, as_shipped, describe));
  }
  return list;
}

}  // namespace

StudyCommand buzzCommand(CLI::App& app) {
  const auto options = std::make_shared<BuzzOptions>();
  StudyCommand command(app, "buzz", "vibration of the command in contact, and what causes it");
  command.quick("a hand that strokes over a still plane at 1 m, as shipped", [options] {
    options->distances_m = {1};
    options->hands = {BuzzHand::stroking};
    options->scenes = {BuzzScene::still};
    options->without = {BuzzWithout::nothing};
  });
  command.names("--laws", options->laws, kProxyLawChoices, "auto");
  command.numbers("--distances", options->distances_m, 0.6, 3.0, "of the plane, metres (0.6,1,1.2)");
  command.choices("--hands", options->hands, kBuzzHands, "all");
  command.choices("--scenes", options->scenes, kBuzzScenes, "all");
  command.choices("--without", options->without, kBuzzCauses, "all");
  command.seed(options->seed, "of the noise (1)");
  command.onRun([options](const StudyCommand& self) {
    const std::vector<BuzzRow> rows = measureBuzz(*options);
    Report report;
    report.say(kExplanation);
    report.table("rows", "", columns(), rows);
    report.requirements(requirementsOf(rows, options->laws));
    return self.report(report);
  });
  return command;
}

}  // namespace hapticd::tools
