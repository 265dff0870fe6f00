// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstddef>
#include <iostream>
#include <memory>
#include <string>

#include "tools/hapticctl/additions/addition_options.h"
#include "tools/hapticctl/additions/pose_lines.h"
#include "tools/hapticctl/base/command_line.h"
#include "tools/hapticctl/text/error_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kFeed = "io.hapticd.Control.FeedPose";

/// Feeds the poses of the lines of standard input until its end. A line that is refused is reported, and the
/// next ones go on.
int feed(const CommandOptions& options, const std::string& name) {
  auto client = connectTo(options, true);
  if (!client) return report(client.error(), options.json);
  std::size_t number = 0, sent = 0, refused = 0;
  for (std::string line; std::getline(std::cin, line);) {
    ++number;
    auto pose = poseFromLine(line);
    if (pose && pose->is_null()) continue;
    if (!pose) {
      ++refused;
      report(base::Error{fmt::format("line {}", number), pose.error(), ""}, options.json);
      continue;
    }
    (*pose)["frame"] = name;
    const auto reply = client->call(kFeed, *pose);
    if (reply) {
      ++sent;
      continue;
    }
    const bool goes_on = reply.error().what == "io.hapticd.Control.PoseRefused" ||
                         reply.error().what == "io.hapticd.Control.FeedLimited";
    const int code = report(reply.error(), options.json);
    if (!goes_on) return code;
    ++refused;
  }
  if (options.json) {
    printJson({{"sent", sent}, {"refused", refused}});
  } else {
    fmt::print("fed {} {}{}\n", sent, sent == 1 ? "pose" : "poses",
               refused == 0 ? "" : fmt::format(", {} refused", refused));
  }
  return refused == 0 ? kOk : kFailed;
}

}  // namespace

void addFrameCommands(CommandLine& line) {
  const CommandOptions& options = line.options();
  CLI::App& group = line.addGroup("frame", "Frames that move in the world, and fixtures with them");
  addListing(line, group, kFrames);
  const auto fed = std::make_shared<std::string>();
  CLI::App& feeding = line.add(group, "feed", "Feed poses of a frame from standard input, a line each",
                               [&options, fed] { return feed(options, *fed); });
  feeding.add_option("NAME", *fed, "Its name")->type_name(kFrames.argument)->required();
  feeding.footer(
      "A line is x,y,z,qx,qy,qz,qw in metres, with a unit quaternion, and optionally\n"
      "behind it the age of the pose in seconds; or a JSON object with the members\n"
      "of FeedPose (positionM, orientationXyzw, timeNs or ageS, velocityMPerS).\n"
      "Empty lines and those that begin with # are left out.\n" +
      feeding.get_footer());
}

}  // namespace hapticd::tools
