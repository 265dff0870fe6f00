// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/occlusion/occlusion_command.h"

#include <fmt/format.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>

#include "config/error.h"
#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/occlusion/occlusion_report.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

constexpr std::array<HandDuringPassage, 5> kAllHands{HandDuringPassage::free, HandDuringPassage::pressing,
                                                     HandDuringPassage::stroking, HandDuringPassage::entering,
                                                     HandDuringPassage::leaving};
constexpr std::array<SceneNoise, 4> kPassageNoises{SceneNoise::none, SceneNoise::quantised,
                                                   SceneNoise::sensor, SceneNoise::harsh};
constexpr std::array<OcclusionPart, 4> kAllParts{OcclusionPart::passages, OcclusionPart::entries,
                                                 OcclusionPart::near, OcclusionPart::pushes};

template <typename Values>
std::vector<std::string> wordsOf(const Values& values) {
  std::vector<std::string> words;
  for (const auto value : values) words.emplace_back(nameOf(value));
  return words;
}

/// Those of `values` that are named; all where none is.
template <typename Values>
void choose(const Values& values, const std::vector<std::string>& names, auto& chosen) {
  if (names.empty()) return;
  chosen.clear();
  for (const auto value : values) {
    if (std::ranges::find(names, nameOf(value)) != names.end()) chosen.push_back(value);
  }
}

}  // namespace

OcclusionCommand::OcclusionCommand(CLI::App& app)
    : command_(app.add_subcommand("occlusion",
                                  "forces while a body passes between the camera and the hand, and where the "
                                  "hand enters from the side")) {
  const auto list = [this](const char* option, auto& values, const char* what) {
    return command_->add_option(option, values, what)->delimiter(',');
  };
  list("--parts", parts_, "of passages, entries, near, pushes (all)")
      ->check(CLI::IsMember(wordsOf(kAllParts)));
  list("--laws", laws_, "of auto, surface, proxy (all)")->check(CLI::IsMember(wordsOf(kShippedLaws)));
  list("--distances", distances_m_, "of the wall, metres (1,2)")->check(within(0.6, 3.8));
  list("--noises", noises_, "of none, quantised, sensor, harsh (none,sensor)")
      ->check(CLI::IsMember(wordsOf(kPassageNoises)));
  list("--hands", hands_, "of free, pressing, stroking, entering, leaving (all)")
      ->check(CLI::IsMember(wordsOf(kAllHands)));
  list("--gaps", gaps_mm_, "from the body's back to the hand, millimetres (20,40,60,100,200,300)")
      ->check(within(5.0, 1000.0));
  command_->add_option("--seed", seed_, "of the noise (1)")
      ->check(within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
  command_->add_flag("--quick", quick_,
                     "one passage each at 1 m, 60 and 100 mm before a free and a pressing hand");
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
}

OcclusionOptions OcclusionCommand::options() const {
  OcclusionOptions options;
  options.seed = seed_;
  if (quick_) {
    options.distances_m = {1};
    options.noises = {SceneNoise::none};
    options.gaps_m = {0.06, 0.1};
    options.thicknesses_m = {0.08};
    options.hands = {HandDuringPassage::free, HandDuringPassage::pressing};
    options.one_passage = true;
  }
  choose(kAllParts, parts_, options.parts);
  choose(kShippedLaws, laws_, options.laws);
  choose(kPassageNoises, noises_, options.noises);
  choose(kAllHands, hands_, options.hands);
  if (!distances_m_.empty()) options.distances_m = distances_m_;
  if (!gaps_mm_.empty()) {
    options.gaps_m.clear();
    options.few_gaps_m.clear();
    for (const double gap_mm : gaps_mm_) {
      options.gaps_m.push_back(gap_mm / 1000);
      options.few_gaps_m.push_back(gap_mm / 1000);
    }
  }
  return options;
}

int OcclusionCommand::run() const {
  const bool watched = isatty(STDERR_FILENO) != 0;
  const OcclusionResult result = measureOcclusion(options(), [watched](const std::string& what) {
    if (watched) fmt::print(stderr, "\r{:<70}", what);
  });
  if (watched) fmt::print(stderr, "\r{:<70}\r", "");
  fmt::print("{}", occlusionTable(result, options()));
  if (json_file_.empty()) return EX_OK;
  const auto written = writeWholeFile(json_file_, occlusionJson(result, options()), IfExists::replace);
  if (written) return EX_OK;
  fmt::print(stderr, "hapticbench: {}\n", written.error().text());
  return EX_CANTCREAT;
}

}  // namespace hapticd::tools
