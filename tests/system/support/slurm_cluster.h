// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A Slurm cluster of one node with two CPUs, as processes of this user on a loopback address: munged,
/// slurmctld and slurmd with keys, state and sockets in a folder of their own. With the object its jobs and
/// daemons end and the folder goes.
class SlurmCluster {
 public:
  /// Why there can be no cluster on this machine; empty where there can. It takes the programs of Debian's
  /// slurm-wlm, and that the machine's name stands for a loopback address, because the daemons listen at the
  /// name's address only.
  static std::string obstacle();

  SlurmCluster();
  ~SlurmCluster();
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  /// Waits until the node takes jobs; a test fails with what the daemons said otherwise.
  bool isReady() const;
  /// Runs a command that talks to this cluster: sbatch, squeue, ...
  Finished run(const std::vector<std::string>& command) const;
  /// A folder that jobs see.
  const std::filesystem::path& folder() const { return folder_.path(); }

 private:
  std::string inFolder(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string configuration() const;
  bool isIdle() const;

  TemporaryFolder folder_;
  ProgramOptions options_;
  std::unique_ptr<Program> munged_;
  std::unique_ptr<Program> slurmctld_;
  std::unique_ptr<Program> slurmd_;
};

/// The processes whose environment has `text` in it, by their ids.
std::vector<std::string> processesWithInEnvironment(const std::string& text);

}  // namespace hapticd::test
