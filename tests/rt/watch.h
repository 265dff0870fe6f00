// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>

namespace hapticd::test {

/// What a thread did that the force thread must not do.
struct Misconduct {
  std::uint64_t allocations = 0;  ///< memory asked for or given back: malloc and its kin, new and delete
  std::uint64_t locks = 0;        ///< mutexes and read-write locks
  std::uint64_t exceptions = 0;   ///< thrown
  bool operator==(const Misconduct&) const = default;
};
inline std::ostream& operator<<(std::ostream& stream, const Misconduct& seen) {
  return stream << seen.allocations << " allocations, " << seen.locks << " locks, " << seen.exceptions
                << " exceptions";
}

/// What this build can see of it. Under a sanitizer the library functions belong to the sanitizer.
struct Sight {
  bool allocations;
  bool aligned_allocations;
  bool locks;
  bool exceptions;
  const char* said_instead;  ///< what is not seen and who sees it; empty when all is seen
};
extern const Sight kSight;

struct PageFaults {
  std::int64_t minor = 0;
  std::int64_t major = 0;  ///< that waited for a disk
};
/// Of the calling thread since its start.
PageFaults pageFaults();

/// Watches the calling thread from construction to end(). Only one at a time in a thread.
class WatchedSection {
 public:
  WatchedSection();
  ~WatchedSection();
  WatchedSection(const WatchedSection&) = delete;
  WatchedSection& operator=(const WatchedSection&) = delete;

  struct Seen {
    Misconduct misconduct;
    PageFaults page_faults;
  };
  /// What the thread did since construction.
  Seen end();

 private:
  PageFaults before_;
};

/// Called by the hooks, in any thread and at any time.
void noteAllocation() noexcept;
void noteLock() noexcept;
void noteException() noexcept;

}  // namespace hapticd::test
