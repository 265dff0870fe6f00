// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "rt/parameters.h"
#include "tools/hapticctl/command_line.h"
#include "tools/hapticctl/error_text.h"
#include "tools/hapticctl/fetch_snapshot.h"
#include "tools/hapticctl/snapshot/depth_picture.h"
#include "tools/hapticctl/snapshot/point_cloud.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/output_file.h"
#include "tools/lib/whole_file/whole_file.h"

namespace hapticd::tools {
namespace {

struct SnapshotOptions {
  std::string ply;
  std::string png;
  IfExists if_exists = IfExists::refuse;
};

/// The radius of the HIP's neighbourhood; the default if the daemon does not report it.
double neighbourhood_m(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.GetParameters", {{"names", {"force.radius_m"}}}});
  const Json rows = reply ? listAt(*reply, "parameters") : Json::array();
  const double radius_m = rows.empty() ? std::nan("") : numberAt(rows.front(), "value");
  return std::isnan(radius_m) ? rt::SpringParameters().radius_m : radius_m;
}

config::Result<void> writeFiles(const Snapshot& snapshot, const SnapshotOptions& requested, double radius_m) {
  if (!requested.ply.empty()) {
    const auto written = writeWholeFile(requested.ply, plyOf(snapshot, radius_m), requested.if_exists);
    if (!written) return written;
  }
  if (requested.png.empty()) return {};
  const auto png = pngOf(snapshot);
  if (!png) return std::unexpected(png.error());
  return writeWholeFile(requested.png, *png, requested.if_exists);
}

void showSnapshot(const Snapshot& snapshot, const SnapshotOptions& requested, bool json) {
  const auto measured = std::ranges::count_if(snapshot.raw, [&](auto raw) {
    return raw != snapshot.depth_model.raw_no_measurement && raw < snapshot.depth_model.raw_values;
  });
  Json files = Json::array();
  for (const std::string& file : {requested.ply, requested.png}) {
    if (!file.empty()) files.push_back(file);
  }
  if (json) return printJson({{"frame", snapshot.frame}, {"measuredPixels", measured}, {"files", files}});
  fmt::print("frame {}: {} of {} pixels measured\n", snapshot.frame, measured, snapshot.raw.size());
  for (const Json& file : files) fmt::print("{}\n", printable(file.get<std::string>()));
}

int runSnapshot(const CommandOptions& options, const SnapshotOptions& requested) {
  for (const std::string& file : {requested.ply, requested.png}) {
    const auto good = file.empty() ? config::Result<void>() : mayWrite(file, requested.if_exists);
    if (!good) return report(good.error(), options.json);
  }
  const auto snapshot = fetchSnapshot(options);
  if (!snapshot) return snapshot.error();
  const double radius_m = requested.ply.empty() ? 0 : neighbourhood_m(options);
  const auto written = writeFiles(*snapshot, requested, radius_m);
  if (!written) return report(written.error(), options.json);
  showSnapshot(*snapshot, requested, options.json);
  return kOk;
}

}  // namespace

void addSnapshotCommand(CommandLine& line) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<SnapshotOptions>();
  CLI::App& command = line.add("snapshot", "Save the depth image of this moment, with the HIP marked",
                               [&options, requested] { return runSnapshot(options, *requested); });
  command.add_option("--ply", requested->ply, "The points in the world, in metres, for MeshLab and others")
      ->type_name("FILE")
      ->check(endsIn(".ply"));
  command
      .add_option("--png", requested->png, "The depth image, light where it is near, with a scale in metres")
      ->type_name("FILE")
      ->check(endsIn(".png"));
  addForce(command, requested->if_exists);
}

}  // namespace hapticd::tools
