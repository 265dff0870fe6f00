// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/hapticd-ros/commands/command_inputs.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/dds/ros_graph.h"

namespace hapticd::tools::ros {

/// What the status file tells of.
struct StatusSources {
  Network network;
  Participant participant;
  std::string name_space;
  std::vector<const Publisher*> publishers;
  const CommandInputs* inputs = nullptr;  ///< null: nothing is taken
  const BoxState& box;
};

/// Announces the node of this program in the domain, and writes what it publishes and takes, and who else
/// takes part, as JSON to a file for `hapticctl ros` and other programs.
/// Thread: one.
class StatusFile {
 public:
  /// path: empty: no file is written. The sources outlive this.
  StatusFile(RosGraph graph, StatusSources sources, std::filesystem::path path);
  /// Removes the file.
  ~StatusFile();
  StatusFile(const StatusFile&) = delete;
  StatusFile& operator=(const StatusFile&) = delete;

  /// To be called once a second. What cannot be written is said once.
  void write();

 private:
  /// Messages of a topic at the last call, for rates.
  struct Counted {
    std::uint64_t messages = 0;
    std::int64_t time_ns = 0;  // CLOCK_MONOTONIC
  };

  void announce();
  Json content();
  Json rateOf(const std::string& topic, std::uint64_t messages);
  Json othersOf(const Publisher& publisher) const;
  Json publishedJson();
  Json takenJson();

  RosGraph graph_;
  StatusSources sources_;
  std::filesystem::path path_;
  std::map<std::string, Counted> counted_;
  bool problem_was_said_ = false;
};

}  // namespace hapticd::tools::ros
