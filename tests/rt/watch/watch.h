// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>

namespace hapticd::test {

/// Activities of a thread that are forbidden in the force thread.
struct Misconduct {
  std::uint64_t allocations = 0;  ///< memory allocated or freed: malloc and related functions, new and delete
  std::uint64_t locks = 0;        ///< operations on mutexes and read-write locks
  std::uint64_t exceptions = 0;   ///< exceptions thrown
  bool operator==(const Misconduct&) const = default;
};
inline std::ostream& operator<<(std::ostream& stream, const Misconduct& seen) {
  return stream << seen.allocations << " allocations, " << seen.locks << " locks, " << seen.exceptions
                << " exceptions";
}

/// What this build can monitor. With a sanitizer, the library functions belong to the sanitizer.
struct Sight {
  bool allocations;
  bool aligned_allocations;
  bool locks;
  bool exceptions;
  const char* said_instead;  ///< what is not monitored and what monitors it instead; empty if everything is
};
extern const Sight kSight;

struct PageFaults {
  std::int64_t minor = 0;
  std::int64_t major = 0;  ///< page faults that waited for a disk
};
/// Returns the page faults of the calling thread since its start.
PageFaults pageFaults();

/// Monitors the calling thread from construction to end(). Only one at a time per thread.
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
  /// Returns what the thread did since construction.
  Seen end();

 private:
  PageFaults before_;
};

/// Locks all present and future memory of the process while the object lives, if permitted.
class LockedMemory {
 public:
  LockedMemory();
  ~LockedMemory();
  LockedMemory(const LockedMemory&) = delete;
  LockedMemory& operator=(const LockedMemory&) = delete;

  /// Returns whether memory is locked according to the kernel; sanitizers pretend to lock memory without
  /// doing so.
  bool locked() const { return locked_; }

 private:
  bool locked_;
};

/// A page that no thread has touched yet, even while memory is locked.
class UntouchedPage {
 public:
  UntouchedPage();
  ~UntouchedPage();
  UntouchedPage(const UntouchedPage&) = delete;
  UntouchedPage& operator=(const UntouchedPage&) = delete;

  void touch();

 private:
  void* page_;
};

/// Called by the hooks, in any thread at any time.
void noteAllocation() noexcept;
void noteLock() noexcept;
void noteException() noexcept;

}  // namespace hapticd::test
