// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <new>
#include <stdexcept>

#include "tests/vendor_devices/arm_memory.h"

namespace hapticd::test {

/// Memory that two processes share by a file.  Errors: std::runtime_error, the file cannot be made or mapped.
template <typename Memory>
class MappedMemory {
 public:
  /// `make`: makes the file anew.
  MappedMemory(const std::filesystem::path& path, bool make) {
    const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | (make ? O_CREAT | O_TRUNC : 0), 0600);
    if (file < 0) throw std::runtime_error("cannot open " + path.string());
    const bool sized = !make || ::ftruncate(file, sizeof(Memory)) == 0;
    void* at =
        sized ? ::mmap(nullptr, sizeof(Memory), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0) : MAP_FAILED;
    ::close(file);
    if (at == MAP_FAILED) throw std::runtime_error("cannot map " + path.string());
    memory_ = make ? new (at) Memory : static_cast<Memory*>(at);
  }
  ~MappedMemory() { ::munmap(memory_, sizeof(Memory)); }
  MappedMemory(const MappedMemory&) = delete;
  MappedMemory& operator=(const MappedMemory&) = delete;
  Memory& memory() const { return *memory_; }

 private:
  Memory* memory_;
};

using MappedArm = MappedMemory<ArmMemory>;

}  // namespace hapticd::test
