// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "made_up_machine.h"
#include "tests/support/program.h"

namespace hapticd::test {

/// Every file, folder and link below a folder: its kind, mode and content.
std::map<std::string, std::string> treeBelow(const std::filesystem::path& root);

bool has(const std::string& text, const std::string& part);

/// tools/realtime-setup on the files of a simulated machine.
class RealtimeSetupOn : public testing::Test {
 protected:
  /// Runs it with `arguments` and the machine's folder as --root.
  Finished run(std::vector<std::string> arguments) const;
  void expectDone(const Finished& finished) const;
  /// Expects exit status 1 and `reason` among the errors.
  void expectRefusal(const Finished& finished, const std::string& reason) const;
  /// Expects that `apply` changes files, and that `revert` leaves all as they were.
  void expectRevertRestoresAll() const;
  std::string content(const std::string& path) const;
  /// Returns the content of a file without comments.
  std::string settings(const std::string& path) const;

  MadeUpMachine machine;
};

}  // namespace hapticd::test
