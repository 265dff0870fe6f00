// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/noise/noise_command.h"

#include <fmt/format.h>
#include <sysexits.h>

#include <cstdio>
#include <iterator>
#include <limits>

#include "tools/hapticbench/noise/noise_report.h"
#include "tools/hapticbench/noise/noise_session.h"
#include "tools/hapticbench/noise/noise_statistics.h"
#include "tools/options/output_file.h"
#include "tools/options/within.h"
#include "tools/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

drivers::SensorNoise::Parameters parametersOf(const std::string& name) {
  return name == "harsh" ? drivers::SensorNoise::harsh() : drivers::SensorNoise::recorded();
}

int failWith(const config::Error& error, int status) {
  fmt::print(stderr, "hapticbench: {}\n", error.text());
  return status;
}

}  // namespace

NoiseCommand::NoiseCommand(CLI::App& app)
    : command_(app.add_subcommand("noise", "statistics of the depth noise of a resting scene")) {
  CLI::Option* recording = command_->add_option(
      "recording", recording_, "folder of an unpacked recording; the camera rests in most of it");
  command_->add_option("--made-up", made_up_, "of the synthetic camera instead: recorded or harsh")
      ->check(CLI::IsMember({"recorded", "harsh"}))
      ->excludes(recording);
  command_->add_option("--windows", windows_px_, "sides of the windows, pixels (24,40,64,96)")
      ->delimiter(',')
      ->check(within(16, 240));
  command_->add_option("--first", first_frame_, "first frame of the recording that is taken (0)")
      ->check(within(0, std::numeric_limits<int>::max() - 600));
  command_->add_option("--frames", frames_, "how many frames are taken (60)")
      ->check(within(kFewestFrames, 600));
  command_->add_option("--seed", seed_, "of the synthetic camera's noise (1)")
      ->check(within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
  command_->add_option("--json", json_file_, "write the result there too")
      ->type_name("FILE")
      ->check(endsIn(".json"));
}

int NoiseCommand::run() const {
  if (recording_.empty() && made_up_.empty()) {
    return failWith({"noise", "there is nothing to measure", "name a recording's folder, or give --made-up"},
                    EX_USAGE);
  }
  NoiseSession session;
  if (made_up_.empty()) {
    auto read = readSession(recording_, {first_frame_, frames_});
    if (!read) return failWith(read.error(), EX_NOINPUT);
    session = std::move(*read);
  } else {
    session = madeUpSession(drivers::SensorNoise(seed_, parametersOf(made_up_)), frames_);
  }
  const std::vector<int> windows_px =
      windows_px_.empty() ? std::vector<int>(std::begin(kWindowSides_px), std::end(kWindowSides_px))
                          : windows_px_;
  std::vector<NoiseStatistics> statistics;
  for (const int window_px : windows_px) statistics.push_back(measureNoise(session, window_px));
  const std::string source =
      made_up_.empty() ? recording_ : fmt::format("the synthetic camera, {}", made_up_);
  fmt::print("{}", noiseTable(source, statistics));
  if (json_file_.empty()) return EX_OK;
  const auto written = writeWholeFile(
      json_file_, noiseJson(source, static_cast<int>(session.frames.size()), statistics), IfExists::replace);
  return written ? EX_OK : failWith(written.error(), EX_CANTCREAT);
}

}  // namespace hapticd::tools
