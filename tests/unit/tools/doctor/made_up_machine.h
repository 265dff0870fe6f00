// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::test {

/// Synthetic files of a machine in a folder. All paths without the leading slash.
class MadeUpMachine {
 public:
  MadeUpMachine();

  const std::filesystem::path& root() const { return folder_.path(); }

  /// A file with this line, and the folders that it takes.
  void set(const std::string& path, const std::string& content) const;
  void makeFolder(const std::string& path) const;
  void link(const std::string& path, const std::string& target) const;
  void remove(const std::string& path) const;
  void setMode(const std::string& path, unsigned mode) const;
  /// A device on USB, with number 5 on bus 2.
  void addUsbDevice(const std::string& name, const std::string& vendor, const std::string& product) const;

 private:
  TemporaryFolder folder_;
};

/// Writes the files of a box without problems: four CPUs, of which 3 is the force loop's, a Kinect, a handle
/// and a GPIO chip.
void fillWithAGoodBox(const MadeUpMachine& machine);

/// The properties that systemd reports of a service without problems.
tools::UnitProperties goodUnit();

/// While the object exists, the process has no privileges for files. Files that it reads must be readable by
/// everyone.
class WithoutPrivileges {
 public:
  WithoutPrivileges();
  ~WithoutPrivileges();
  WithoutPrivileges(const WithoutPrivileges&) = delete;
  WithoutPrivileges& operator=(const WithoutPrivileges&) = delete;

 private:
  uid_t user_;
};

}  // namespace hapticd::test
