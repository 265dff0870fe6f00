// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "config/base/descriptor.h"

struct seccomp_data;

namespace hapticd::test {

/// A disk that stops answering whenever the test wants: the system calls of a program on paths below a folder
/// and on files that it opened there then wait inside the kernel (seccomp_unotify(2)), in whichever thread.
/// Such a program can be killed, unlike one that waits for a real disk. Give it to the Program that it is for
/// (ProgramOptions::disk), which starts and ends before it.
class DiskStall {
 public:
  explicit DiskStall(std::filesystem::path folder);
  ~DiskStall();
  DiskStall(const DiskStall&) = delete;
  DiskStall& operator=(const DiskStall&) = delete;

  /// From now on, or until end(), calls wait.
  void begin() { stalled_ = true; }
  /// Lets those that wait and all later ones go on.
  void end();
  /// The number of calls that wait now.
  std::size_t waiting() const { return waiting_; }

  /// Hands the calls of this process and those of its children over; false if the kernel does not permit it.
  /// Uses system calls only, for use between fork and exec.
  bool install() const;
  /// To be called in the parent after fork(): takes the calls over. False if install() did not work.
  bool supervise();

 private:
  void answerCalls();
  bool reachesForFolder(pid_t thread, const seccomp_data& call) const;
  void letGoOn(std::uint64_t call) const;

  const std::string folder_;
  base::Descriptor child_end_;  // on which the child sends the descriptor of its calls
  base::Descriptor parent_end_;
  base::Descriptor calls_;
  base::Descriptor wake_;
  std::vector<std::uint64_t> held_;  // of the thread
  std::atomic<bool> stalled_{false};
  std::atomic<bool> stop_{false};
  std::atomic<std::size_t> waiting_{0};
  std::thread thread_;
};

}  // namespace hapticd::test
